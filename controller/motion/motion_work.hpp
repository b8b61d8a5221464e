// What a motion has computed so far, and with that what it could leave out: `explain` and `study skip` tell it.
#pragma once

#include <cstdint>

namespace proxarm::controller {

struct MotionWork {
  std::uint64_t steps = 0;        // of rendering
  std::uint64_t programs = 0;     // quadratic programs of steps that the joints can't follow (arm_step.hpp)
  std::uint64_t limited = 0;      // steps in which a limit held the proxy back: those looked for the nearest point
  std::uint64_t joint_steps = 0;  // of inverse kinematics, Newton's or damped
  std::uint64_t guarded = 0;      // setpoints that the tool's guard judged exactly, since they were near a bound
  std::uint64_t held_back = 0;    // of these, those that it held back: none in a session without a fault
};

}  // namespace proxarm::controller
