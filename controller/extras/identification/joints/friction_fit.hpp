// Fits friction and rotor inertia of one joint to the torque of its motor, in the frequency domain: equation (1) of
// joint_fit.hpp.
#pragma once

#include <Eigen/Core>

#include "controller/extras/identification/joints/joint_motion.hpp"
#include "controller/extras/identification/joints/link_response.hpp"

namespace proxarm::identification {

struct FrictionInputs {
  const MotionRecord& slow;
  const MotionRecord& fast;
  double rated_torque_Nm = 0.0;
  double torque_step_Nm = 0.0;  // resolution of 6077h
  double encoder_step_rad = 0.0;
  double line_share = 0.01;
};

// The values of J, F, b, and their standard deviations.
struct FrictionFit {
  Eigen::Vector3d value = Eigen::Vector3d::Zero(), deviation = Eigen::Vector3d::Zero();
};

// Precondition: the drive's torque was read. `gears` determine the links' part of the torque in the fast motion.
FrictionFit fit_friction(const models::Arm& arm, const LinkResponse& response, const Gears& gears,
                         const FrictionInputs& inputs);

}  // namespace proxarm::identification
