// Counts a motion's computations, which shows what it could skip. `explain` and `study skip` report the counts.
#pragma once

#include <cstdint>

namespace proxarm::controller {

struct MotionWork {
  std::uint64_t steps = 0;        // of rendering
  std::uint64_t programs = 0;     // quadratic programs, for steps that the joints can't follow (arm_step.hpp)
  std::uint64_t limited = 0;      // steps in which a limit held the proxy back, so that the nearest point was searched
  std::uint64_t joint_steps = 0;  // of inverse kinematics, Newton or damped
  std::uint64_t guarded = 0;      // setpoints near a bound, judged exactly by the tool guard
  std::uint64_t held_back = 0;    // of these, held back; none in a session without a fault
};

}  // namespace proxarm::controller
