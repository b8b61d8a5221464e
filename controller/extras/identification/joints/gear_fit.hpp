// Fits stiffness and damping of all gears to the sensor's readings while the motors swing the tool.
//
// Over the lines of the fast motions, the fit minimises the difference between the readings and (3) of
// link_response.hpp,
//   s e^(−iωδ)/(1 + iω/ω_s) · reading(links(K, D, θ)),   ω_s: the sensor's bandwidth
// The unknowns are ln k and ln d of each gear, δ, ln s, and ln S of each link. The method is that of Levenberg and
// Marquardt ("An algorithm for least-squares estimation of nonlinear parameters", 1963). Its start is the best of a
// search along each k and d. Each unknown has a row that expects the cell's value. The standard deviation of this row
// is a factor of 4.5 for k and d, 2 ms for δ, and stated shares for s and for the links' inertias. A gear isn't
// identifiable if another stiffness, or a rigid gear, explains the readings nearly as well.
#pragma once

#include <vector>

#include "controller/extras/identification/joints/joint_motion.hpp"
#include "controller/extras/identification/joints/link_response.hpp"

namespace proxarm::identification {

struct GearLine {
  double omega = 0.0;
  ComplexJoints motors;
  ComplexWrench reading;
  Eigen::Matrix<double, 6, 1> deviation;  // standard deviation of real and imaginary part
};

// Returns the lines of the fast motions. Precondition: `line_share` > 0; the records are fast motions.
std::vector<GearLine> gear_lines(const std::vector<MotionRecord>& fast, double line_share);

struct GearFit {
  Gears gears;
  // Standard deviations of ln k and ln d; infinite: not identifiable.
  Eigen::VectorXd stiffness_deviation, damping_deviation;
  double delay_s = 0.0, scale = 1.0;
  double left_over_share = 0.0;  // share of the readings' lines that isn't explained, root mean square
};

struct GearStart {
  Gears gears;  // start of the search; all values are above 0
  double sensor_bandwidth_Hz = 0.0, sensor_scale = 0.03, link_inertia = 0.025;
};

GearFit fit_gears(const LinkResponse& response, const std::vector<GearLine>& lines, const GearStart& start);

}  // namespace proxarm::identification
