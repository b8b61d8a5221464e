// Counts a motion's computations. The counts show which computations could be skipped; `explain` and `study skip`
// report the counts.
#pragma once

#include <cstdint>

namespace proxarm::controller {

struct MotionWork {
  std::uint64_t steps = 0;        // steps of rendering
  std::uint64_t programs = 0;     // quadratic programs, solved for steps that the joints can't follow (arm_step.hpp)
  std::uint64_t limited = 0;      // steps in which a limit held the proxy back, so that the nearest point was searched
  std::uint64_t joint_steps = 0;  // iterations of inverse kinematics, Newton's or damped
  std::uint64_t guarded = 0;      // setpoints near a bound, which the tool guard judged exactly
  std::uint64_t held_back = 0;    // setpoints that the tool guard held back; none in a session without a fault
};

}  // namespace proxarm::controller
