// Reports faults to the supervisor, with the number of the cycle. All parts of the cycle report faults through an
// Alarm.
#pragma once

#include <cstdint>

#include "controller/supervision/supervisor.hpp"
#include "models/base/archive_fields.hpp"
#include "models/geometry/geometry.hpp"

namespace proxarm::controller {

class Alarm {
 public:
  // Precondition: `supervisor` and `cycle` outlive this object.
  Alarm(Supervisor& supervisor, const std::uint64_t& cycle) noexcept : supervisor_(supervisor), cycle_(cycle) {}

  // Reports a fault. `where`: drive index, bus index, or −1 for the sensor and the controller (FaultReport).
  void raise(Fault fault, std::int32_t where = -1, double value = 0.0, double limit = 0.0) noexcept {
    if (supervisor_.reaction(fault) == Reaction::hold) state_.hold_raised = true;
    supervisor_.raise({fault, where, cycle_, value, limit});
  }
  // Reports a force on the handle during the tare.
  void raise_standing(const models::Vec3& force_W, double limit_N) noexcept {
    supervisor_.raise({.fault = Fault::force_at_start,
                       .cycle = cycle_,
                       .value = force_W.norm(),
                       .limit = limit_N,
                       .force_W_N = {force_W.x(), force_W.y(), force_W.z()}});
  }
  // Whether a fault with reaction `hold` was raised since the last call.
  [[nodiscard]] bool take_hold() noexcept {
    const bool raised = state_.hold_raised;
    state_.hold_raised = false;
    return raised;
  }
  void archive(fieldbus::StateArchive& state) noexcept { archive_fields(state, state_); }

 private:
  struct State {
    bool hold_raised = false;
  };

  Supervisor& supervisor_;
  const std::uint64_t& cycle_;
  State state_;
};

}  // namespace proxarm::controller
