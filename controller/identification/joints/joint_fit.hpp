// Identifies friction, rotor inertia, gear stiffness and gear damping of each joint from records of small motions, with
// uncertainties. The arm's library gives masses, gravity and Jacobians; everything else is here.
//
// For a joint, behind the gear, with θ the motor's angle and φ the link's (rad; for linear joints m, N, kg):
//   τ = J θ̈ + b θ̇ + F sgn(θ̇) + τ_gear                                                      (1)
//   τ_gear = k (θ − φ) + d (θ̇ − φ̇) = [M(φ) φ̈ + τ_g(φ)]                                     (2)
//   τ  Nm, motor torque: 6077h times rated_torque_Nm         J  kg m², rotor's inertia at the joint
//   F  Nm, Coulomb friction    b  Nms/rad, viscous friction  k  Nm/rad, d  Nms/rad, gear
//   M  kg m², links and tool   τ_g  Nm, gravity
//
// Gears come first. The drives control the motors, so θ is known independently of friction, and the sensor reads how
// the tool swings (link_response.hpp; fast motions of all joints). Unknown are ln k, ln d, the sensor's delay and
// scale. The response isn't convex in k, so each k is first tried from a third to three times the cell's value. Then
// (1) is fitted for each joint to the lines of both motions: linear in J, F, b and the delay δ of 6077h, τ(t) ≈ τ_read
// + δ dτ_read/dt. The fast motion has its own friction, since it reaches lower speeds.
//
// A drive reads its torque once a cycle T, where two setpoints meet. If it moves straight between setpoints, with a
// position loop of bandwidth f_p, it reads less there than the mean, by (2π f_p T)²/12 of J θ̈; otherwise not. So J has
// this standard deviation.
//
// Allowances (Allowed) cover what isn't measured: link inertias that differ from the URDF's, a wrong scale of the
// drive's torque, a tilted sensor. The interval includes these and the noise. A value known at best to half of itself
// is not identifiable.
#pragma once

#include <string>
#include <vector>

#include "controller/identification/joints/joint_motion.hpp"

namespace proxarm::identification {

// Standard deviations of quantities that aren't measured, as shares.
struct Allowed {
  double link_inertia = 0.025, torque_scale = 0.025, sensor_scale = 0.03;
  double line = 0.01;          // of a line's size: tilted sensor, changing poses, resolution
  double torque_line = 0.003;  // the same for the drive's torque
  double zero_drift_N = 1.0;   // of the sensor, over all motions
};

struct Estimate {
  bool found = false;
  double value = 0.0, half = 0.0;  // of the 95 % interval
  std::string reason;              // why it isn't identifiable
};

struct JointEstimates {
  Estimate coulomb_Nm, viscous_Nms_per_rad, rotor_inertia_kg_m2, stiffness_Nm_per_rad, damping_Nms_per_rad;
};

struct JointsFit {
  std::vector<JointEstimates> joints;
  // Why the whole result is doubtful, such as a hand at the handle; empty: no doubt.
  std::string doubt;
  double left_over_share = 0.0;  // residual share of the sensor's lines, root mean square
};

// Precondition: complete records, two of each joint in the joints' order. Throws SetupError if the arm can't be built.
JointsFit identify_joints(const description::Cell& cell, const std::vector<MotionRecord>& records,
                          const Allowed& allowed);

}  // namespace proxarm::identification
