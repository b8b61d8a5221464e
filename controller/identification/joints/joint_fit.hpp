// Friction, rotor inertia, gear stiffness and damping of each joint, from the records of small motions, with their
// uncertainty. The arm's library gives masses, gravity and Jacobians; all else is here.
//
// A joint, after the gear, with θ the motor's angle and φ the link's (rad; of a linear joint read m, N, kg):
//   τ = J θ̈ + b θ̇ + F sgn(θ̇) + τ_gear                                                      (1)
//   τ_gear = k (θ − φ) + d (θ̇ − φ̇) = [M(φ) φ̈ + τ_g(φ)]                                     (2)
//   τ  Nm, the motor's by 6077h times rated_torque_Nm        J  kg m², rotor as seen at the joint
//   F  Nm, Coulomb friction    b  Nms/rad, viscous friction  k  Nm/rad, d  Nms/rad, gear
//   M  kg m², links and tool   τ_g  Nm, gravity
//
// Gears first. Motors are led by their drives, so that θ is known whatever friction does, and the sensor reads how the
// tool at the far end swings: link_response.hpp, fast motions, all joints at once. Unknown are ln k, ln d, the sensor's
// delay and its scale. The response isn't convex in k, so each k is first tried from a third to three times the cell's.
// Then (1), for each joint, in the lines of both motions: linear in J, F, b and in the delay δ of 6077h,
// τ(t) ≈ τ_read + δ dτ_read/dt. Friction of the fast motion counts for itself, since it is that of slower speeds.
//
// A drive reads its torque where setpoints follow one another, once a cycle T. One that goes straight from setpoint to
// setpoint with a position loop of bandwidth f_p gives less there than in the mean, by (2π f_p T)²/12 of J θ̈; one that
// goes on a curve, or filters what it reads, doesn't. J is allowed to be off by that, as a standard deviation.
//
// Not measured, and therefore allowed for (Allowed): links whose inertias are others than the URDF's, a drive whose
// torque has another scale, a sensor that is tilted. The interval is what all that and the noise leave open; a figure
// that is then known to half of its value at best is called not identifiable.
#pragma once

#include <string>
#include <vector>

#include "controller/identification/joints/joint_motion.hpp"

namespace proxarm::identification {

// Standard deviations of what isn't measured, as shares.
struct Allowed {
  double link_inertia = 0.025, torque_scale = 0.025, sensor_scale = 0.03;
  double line = 0.01;          // of a line's size: tilted sensor, poses that change, resolution
  double torque_line = 0.003;  // likewise of the drive's torque
  double zero_drift_N = 1.0;   // of the sensor, while all motions last
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
  // Why nothing of it is to be believed: a hand at the handle, say; empty: nothing speaks against it.
  std::string doubt;
  double left_over_share = 0.0;  // of the sensor's lines, root mean square
};

// Precondition: records are whole, two of each joint in their order. Throws SetupError for an arm that can't be built.
JointsFit identify_joints(const description::Cell& cell, const std::vector<MotionRecord>& records,
                          const Allowed& allowed);

}  // namespace proxarm::identification
