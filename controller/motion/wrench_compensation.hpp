// From what the sensor reads to what the user's hand does: bias and the tool's weight taken off, expressed at the tool.
//
// The sensor reads the wrench w_S that the tool side exerts on the flange side, in S and about S's origin:
//
//   w_S = bias + (hand's wrench) + (weight of the tool) − (inertia of the tool)
//
// The weight, m R_SW g at the tool's centre of mass c, is subtracted; the inertia is not: a handle of mass m behind the
// sensor is felt in full, so (26) gets the wanted mass less m. The bias is what a reading at rest, with no hand on the
// handle, has over the weight.
#pragma once

#include <cstdint>

#include "models/base/state_archive.hpp"
#include "models/description/cell.hpp"
#include "models/geometry/geometry.hpp"

namespace proxarm::controller {

class WrenchCompensation {
 public:
  explicit WrenchCompensation(const description::Cell& cell);

  // Weight of the tool about S's origin, in S, with the sensor held at R_WS.
  [[nodiscard]] models::Wrench tool_weight_S(const models::Mat3& R_WS) const noexcept;

  // Adds one reading at rest to the average that becomes the bias.
  void add_tare_sample(const models::Wrench& reading_S, const models::Mat3& R_WS) noexcept;
  // Takes the average so far as the bias; at least one sample must have been added.
  void finish_tare() noexcept;
  // Largest deviation of a sample from the running mean, in N: the handle was touched if it exceeds the noise.
  [[nodiscard]] double tare_spread_N() const noexcept { return tare_spread_N_; }
  [[nodiscard]] const models::Wrench& bias_S() const noexcept { return bias_S_; }

  // The hand's wrench about T's origin, in W.
  [[nodiscard]] models::Wrench hand_wrench_W(const models::Wrench& reading_S, const models::Mat3& R_WS) const noexcept;

  void archive(fieldbus::StateArchive& state) noexcept {
    state(bias_S_.force, bias_S_.torque, tare_sum_S_.force, tare_sum_S_.torque, tare_count_, tare_spread_N_);
  }

 private:
  double mass_kg_;
  models::Vec3 centre_of_mass_S_;
  models::Vec3 handle_S_;  // from S's origin to T's
  models::Vec3 gravity_W_;
  models::Wrench bias_S_;
  models::Wrench tare_sum_S_;
  std::int64_t tare_count_ = 0;
  double tare_spread_N_ = 0.0;
};

}  // namespace proxarm::controller
