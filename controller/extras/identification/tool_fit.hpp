// Computes the tool's mass and centre of mass and the sensor's zero, with their uncertainties, from readings of the
// resting arm.
//
// In pose k, with all vectors in S except g and δ:
//   F_k = b + d s_k + m R(ε) R_SW(k) R(δ) g      b: zero of the force at the last pose; d: drift of the zero
//   τ_k = b' + d' s_k + c × (F_k − b − d s_k)    b', d': the same for the torque; c: centre of mass
// s_k is the time from the last pose, as a share of the whole time: −1 at the first pose, 0 at the last. The rotation
// vectors ε and δ are mounting errors: ε of the sensor on its flange, δ of the base against the vertical.
//
// The forces are fitted first, by Gauss-Newton. The start is a fit of m and b alone, since m multiplies ε and δ. Then
// the torques are fitted, which are linear in c. Their fit uses the measured weight, so c doesn't depend on mounting
// errors.
//
// Drift and mounting errors are nuisance parameters. Each has the expected value 0, a standard deviation (Allowances)
// and a row in the least squares. The covariance is the inverse normal matrix. It is multiplied by χ²/ν if the readings
// scatter by more than noise and allowances explain.
//
// The direction of the weight in S must vary enough: the standard deviation of the direction over the poses must exceed
// five times the standard deviation of the mounting error. This must hold along one direction for mass and zero to be
// identifiable, and along two directions for c.
#pragma once

#include <vector>

#include "models/geometry/geometry.hpp"

namespace proxarm::identification {

// The sensor's mean reading in a pose, and the standard deviations of the mean.
struct PoseReading {
  models::Mat3 R_SW = models::Mat3::Identity();
  models::Wrench mean_S;
  double noise_N = 0.0, noise_Nm = 0.0;  // standard deviation of the mean on each axis
  double tilt_rad = 0.0;                 // uncertainty of R_SW due to the gears
  double time_s = 0.0;                   // increasing
};

// Standard deviations of quantities that aren't measured.
struct Allowances {
  // Mounting error of the sensor about each axis of S, and of the base about each axis of W.
  double mounting_rad = 0.0;
  // Drift of the zero on each axis from the first pose to the last. The drift of torques is this times lever_m.
  double zero_drift_N = 0.0;
};

// Converts an error of force to an error of torque; about the length of a handle.
inline constexpr double lever_m = 0.1;
// Half of a 95 % interval, in standard deviations.
inline constexpr double deviations_of_95 = 1.959964;

// How well the model explains the readings.
struct Misfit {
  // `most`: bound of chi_squared. If no hand touches the tool, one session in 30,000 exceeds it.
  double chi_squared = 0.0, most = 0.0;
  int worst_pose = 0;
  // Residual in the worst pose, and the residual's standard deviation: N or Nm.
  double worst = 0.0, explained = 0.0;

  [[nodiscard]] bool explained_all() const noexcept { return chi_squared <= most; }
};

// The tool and the zero, with half of the 95 % interval of each value.
struct ToolFit {
  bool mass_found = false, centre_found = false;
  double mass_kg = 0.0, mass_half_kg = 0.0;
  models::Vec3 centre_S_m = models::Vec3::Zero(), centre_half_m = models::Vec3::Zero();
  models::Wrench zero_S, zero_half_S;  // the zero at the last pose
  double turned_rad = 0.0;             // |ε| + |δ|, the mounting errors of the fit
  Misfit force, torque;
};

// Returns how much the direction of the weight in S varies over the poses: standard deviations along the principal
// axes, as shares of the weight, the largest first.
models::Vec3 spread(const std::vector<models::Mat3>& R_SW, const models::Vec3& gravity_W) noexcept;

// Return whether this spread determines mass and zero, and whether it determines the centre of mass.
[[nodiscard]] bool shows_mass(const models::Vec3& spread, const Allowances& allowances) noexcept;
[[nodiscard]] bool shows_centre(const models::Vec3& spread, const Allowances& allowances) noexcept;

// Returns the fitted tool. With fewer than three readings, or with poses that determine nothing, nothing is found.
// Precondition: noise or allowances are above 0, so that no reading counts as exact; gravity isn't 0.
ToolFit fit_tool(const std::vector<PoseReading>& readings, const models::Vec3& gravity_W, const Allowances& allowances);

}  // namespace proxarm::identification
