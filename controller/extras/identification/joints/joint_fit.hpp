// Identifies friction, rotor inertia, gear stiffness and gear damping of each joint, with uncertainties, from records
// of small motions. Masses, gravity and Jacobians come from the arm's library; everything else is computed here.
//
// For each joint, with all quantities on the joint's side of the gear:
//   τ = J θ̈ + b θ̇ + F sgn(θ̇) + τ_gear                                                      (1)
//   τ_gear = k (θ − φ) + d (θ̇ − φ̇) = [M(φ) φ̈ + τ_g(φ)]                                     (2)
// Units for a rotating joint; a linear joint has m, N and kg instead of rad, Nm and kg m²:
//   θ    rad, the motor's angle
//   φ    rad, the link's angle
//   τ    Nm, the motor's torque: 6077h times rated_torque_Nm
//   J    kg m², inertia of the rotor at the joint
//   b    Nms/rad, viscous friction
//   F    Nm, Coulomb friction
//   k    Nm/rad, stiffness of the gear
//   d    Nms/rad, damping of the gear
//   M    kg m², inertia of links and tool
//   τ_g  Nm, gravity's torque
//
// The gears are fitted first. θ is measured independently of friction, since the drives control the motors; and the
// sensor measures how the tool swings (link_response.hpp; fast motions of all joints). The unknowns are ln k, ln d, the
// sensor's delay and the sensor's scale. The response isn't convex in k, so each k is first tried from a third to three
// times the cell's value.
//
// Then (1) is fitted for each joint to the lines of both motions. The fit is linear in J, F, b and the delay δ of
// 6077h, τ(t) ≈ τ_read + δ dτ_read/dt. The fast motion has its own friction, since it reaches lower speeds.
//
// A drive reads its torque once a cycle T, where two setpoints meet. If the drive moves straight between setpoints,
// with a position loop of bandwidth f_p, the torque at these times is smaller than the mean torque, by (2π f_p T)²/12
// of J θ̈. If the drive moves in another way, the torque isn't smaller. So this share of J is part of J's standard
// deviation.
//
// Allowances (Allowed) cover what isn't measured: link inertias that differ from the URDF's, a wrong scale of the
// drive's torque, a tilted sensor. The 95 % interval includes the allowances and the noise. A value isn't identifiable
// if half of its interval exceeds half of the value.
#pragma once

#include <string>
#include <vector>

#include "controller/extras/identification/joints/joint_motion.hpp"

namespace proxarm::identification {

// Standard deviations of quantities that aren't measured. They are shares, apart from zero_drift_N.
struct Allowed {
  double link_inertia = 0.025, torque_scale = 0.025, sensor_scale = 0.03;
  // Share of a line's size, for a tilted sensor, changing poses and resolution.
  double line = 0.01;
  double torque_line = 0.003;  // share of a torque line's size
  double zero_drift_N = 1.0;   // drift of the sensor's zero over all motions
};

struct Estimate {
  bool found = false;
  double value = 0.0, half = 0.0;  // half of the 95 % interval
  std::string reason;              // why the value isn't identifiable
};

struct JointEstimates {
  Estimate coulomb_Nm, viscous_Nms_per_rad, rotor_inertia_kg_m2, stiffness_Nm_per_rad, damping_Nms_per_rad;
};

struct JointsFit {
  std::vector<JointEstimates> joints;
  // Why the whole result is doubtful, such as a hand at the handle; empty: there is no doubt.
  std::string doubt;
  double left_over_share = 0.0;  // share of the sensor's lines that isn't explained, root mean square
};

// Precondition: the records are complete, two for each joint in the joints' order. Throws SetupError if the arm can't
// be built.
JointsFit identify_joints(const description::Cell& cell, const std::vector<MotionRecord>& records,
                          const Allowed& allowed);

}  // namespace proxarm::identification
