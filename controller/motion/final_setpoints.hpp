// The one place where setpoints become final, in every phase: what drives that don't follow allow, then each joint's
// own limits (joint_guard.hpp), then those of tool and elbow (tool_guard.hpp). Neither allocates, locks nor throws.
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
  // At rest at these angles of the motors.
  void start(const models::JointVector& target_rad) noexcept;

  struct Result {
    ActiveLimits limits;       // that held something back
    std::uint8_t blocked = 0;  // joints whose drives don't follow, as bits
    bool guarded = false;      // the tool's guard, which is the last one, held something back
    // What was wanted can't be caught up: the motion has to go on from what was commanded. A guard that holds back a
    // little is caught up with, as joints that lag are: going on from setpoints takes the motors' lead for the links'
    // place, and would shake the tool. A little: what moves the tool no further than limits.following_error_rad of the
    // joint that moves it furthest.
    bool differs = false;
  };
  // Bounds on the setpoints of one period.
  struct Bounds {
    double max_speed_m_per_s;  // the tool's present speed limit
    models::Vec3 links_W;      // where the motors lead the links' tool
    const TurnSets* turn;      // limits of turning; null: they aren't judged
  };
  // One period towards these angles of the motors.
  Result step(const models::JointVector& motor_rad, const Measured& measured, const Bounds& bounds) noexcept;
  // After a step that differs: what is wanted next counts from here. Returns the motors' speeds, rad/s.
  models::JointVector go_on_from_here(std::uint8_t blocked) noexcept;

  // Begins to bring the joints to rest: every joint decelerates from its last speed in the same time.
  void start_run_out() noexcept;
  ActiveLimits run_out() noexcept;
  [[nodiscard]] bool has_run_out() const noexcept { return state_.run_out_share <= 0.0 && guard_.at_rest(); }

  // The largest step of each joint in one cycle, at its drive's highest speed.
  [[nodiscard]] std::array<double, models::max_axes> max_steps_rad(double period_s) const noexcept {
    return controller::max_steps_rad(drives_, period_s);
  }
  [[nodiscard]] const models::JointVector& target_rad() const noexcept { return guard_.target_rad(); }
  [[nodiscard]] bool at_rest() const noexcept { return guard_.at_rest(); }
  // How many setpoints the tool's guard has judged exactly, since they were near a bound.
  [[nodiscard]] std::uint64_t judged_exactly() const noexcept { return tool_guard_.judged_exactly(); }
  void archive(fieldbus::StateArchive& state) noexcept;

 private:
  struct State {
    models::JointVector run_out_rad_per_s;  // each joint's speed when the run-out began
    double run_out_share = 1.0;             // the share of that speed that is left
    double run_out_per_cycle = 1.0;         // by which the share shrinks in each cycle
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
  models::JointVector lever_;  // of each joint: how far it moves the tool at most, as a share of the longest
  SetpointEnvelope envelope_;  // of the setpoints; a blocked joint's is frozen
  State state_;
};

}  // namespace proxarm::controller
