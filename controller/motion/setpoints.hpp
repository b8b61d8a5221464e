// The setpoints that a motion makes and the drives receive.
#pragma once

#include <cstdint>

#include "models/arm/arm.hpp"

namespace proxarm::controller {

// In the order of the joints: motor angles or joint torques.
struct Setpoints {
  enum class Kind : std::uint8_t { angles_rad, torques_Nm };
  Kind kind = Kind::angles_rad;
  models::JointVector values;
};

}  // namespace proxarm::controller
