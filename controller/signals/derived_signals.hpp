// Derives signals from a cycle's record: joint angles and torques in SI units, and the tool's orientation. Not for the
// cycle: takes some microseconds.
#pragma once

#include "controller/signals/signal_columns.hpp"
#include "models/arm/arm.hpp"
#include "models/description/cell.hpp"

namespace proxarm::controller {

class SignalDeriver {
 public:
  // Precondition: the cell outlives this object. Throws SetupError.
  explicit SignalDeriver(const description::Cell& cell);
  [[nodiscard]] DerivedSignals derive(const CycleRecord& record) const;
  // Returns the links' angles by the encoders.
  [[nodiscard]] models::JointVector link_rad(const CycleRecord& record) const;
  [[nodiscard]] const models::Arm& arm() const noexcept { return arm_; }

 private:
  const description::Cell& cell_;
  models::Arm arm_;
};

}  // namespace proxarm::controller
