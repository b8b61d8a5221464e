// Defines the setpoints that a motion makes and the drives receive.
#pragma once

#include <cstdint>

#include "models/arm/arm.hpp"

namespace proxarm::controller {

// Motor angles or joint torques, in the order of the joints.
struct Setpoints {
  enum class Kind : std::uint8_t { angles_rad, torques_Nm };
  Kind kind = Kind::angles_rad;
  models::JointVector values;
};

}  // namespace proxarm::controller
