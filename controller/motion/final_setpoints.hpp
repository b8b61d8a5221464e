// Makes the final setpoints from the wanted ones, in all phases of a session. Three changes follow one another: for
// drives that don't follow, for the joints' limits (joint_guard.hpp), and for the limits of tool and elbow
// (tool_guard.hpp). Nothing allocates, locks or throws.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "controller/limits/step_limits.hpp"
#include "controller/motion/cycle_parts.hpp"
#include "controller/motion/measurement.hpp"
#include "controller/setpoints/joint_guard.hpp"
#include "controller/setpoints/setpoint_envelope.hpp"
#include "controller/setpoints/tool_guard.hpp"
#include "models/arm/arm.hpp"
#include "models/base/state_archive.hpp"
#include "models/description/cell.hpp"

namespace proxarm::controller {

class FinalSetpoints {
 public:
  // Precondition: `arm` outlives this object.
  FinalSetpoints(const models::Arm& arm, const std::vector<description::DriveDescription>& drives,
                 const description::CellLimits& limits, double period_s);

  void set_period(double period_s) noexcept;
  // Starts at rest at these motor angles.
  void start(const models::JointVector& target_rad) noexcept;

  struct Result {
    ActiveLimits limits;       // limits that held a setpoint back
    std::uint8_t blocked = 0;  // joints whose drives don't follow, as bits
    bool guarded = false;      // the tool guard held a setpoint back
    // The wanted setpoints can't be caught up; the motion must continue from the commanded ones. A small lag is caught
    // up instead: to continue from setpoints takes the motors' angles for the links' and would shake the tool. A lag is
    // small if it moves the tool no further than limits.following_error_rad of the joint with the longest lever;
    // without a revolute joint, no further than that number of metres.
    bool differs = false;
  };
  struct Bounds {
    double max_speed_m_per_s;  // the tool's present speed limit
    models::Vec3 links_W;      // the tool's place by the link angles, which the motor angles lead
    const TurnSets* turn;      // limits of turning; null: turning isn't judged
  };
  // Moves the setpoints one period towards the wanted ones, motor_rad.
  Result step(const models::JointVector& motor_rad, const Measured& measured, const Bounds& bounds) noexcept;
  // Call after a step whose result `differs`: the next wanted setpoints continue from the commanded ones. Returns the
  // motor speeds, rad/s.
  models::JointVector go_on_from_here(std::uint8_t blocked) noexcept;

  // Begins to brake all joints to rest. Each joint decelerates evenly from its last speed; all joints stop together.
  void start_run_out() noexcept;
  ActiveLimits run_out() noexcept;
  [[nodiscard]] bool has_run_out() const noexcept { return state_.run_out_share <= 0.0 && guard_.at_rest(); }

  [[nodiscard]] std::array<double, models::max_axes> max_steps_rad(double period_s) const noexcept {
    return controller::max_steps_rad(drives_, period_s);
  }
  [[nodiscard]] const models::JointVector& target_rad() const noexcept { return guard_.target_rad(); }
  [[nodiscard]] bool at_rest() const noexcept { return guard_.at_rest(); }
  // Number of setpoints near a bound, which the tool guard judged exactly.
  [[nodiscard]] std::uint64_t judged_exactly() const noexcept { return tool_guard_.judged_exactly(); }
  void archive(fieldbus::StateArchive& state) noexcept;

 private:
  struct State {
    models::JointVector run_out_rad_per_s;  // each joint's speed when the run-out began
    double run_out_share = 1.0;             // remaining share of run_out_rad_per_s
    double run_out_per_cycle = 1.0;         // decrease of the share per cycle
  };

  ActiveLimits guard(const models::JointVector& wanted_rad, const Bounds* bounds, bool& held_back) noexcept;
  [[nodiscard]] std::uint8_t find_blocked(const models::JointVector& motor_rad, const Measured& measured,
                                          models::JointVector& wanted_rad) const noexcept;
  [[nodiscard]] double lag_rad() const noexcept;
  void follow(const Measured& measured, std::uint8_t blocked) noexcept;

  std::vector<description::DriveDescription> drives_;
  description::CellLimits limits_;
  double period_s_;
  JointGuard guard_;
  ToolGuard tool_guard_;
  // How far each joint moves the tool at most (m/rad, m/m), relative to the revolute joint that moves it most.
  models::JointVector lever_;
  SetpointEnvelope envelope_;  // of the setpoints; frozen for blocked joints
  State state_;
};

}  // namespace proxarm::controller
