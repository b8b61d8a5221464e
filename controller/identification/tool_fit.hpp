// Computes the tool's mass and centre of mass and the sensor's zero from readings at rest, with their uncertainties.
//
// In pose k, with all vectors but g and δ in S:
//   F_k = b + d s_k + m R(ε) R_SW(k) R(δ) g      b: the zero at the last pose; d: its drift
//   τ_k = b' + d' s_k + c × (F_k − b − d s_k)    s_k: time before the last pose, from −1 (the first) to 0
// The rotation vectors ε and δ are mounting errors: of the sensor on its flange and of the base against the vertical.
// The forces are fitted first, by Gauss-Newton from m and b alone, since m multiplies ε and δ. Then the torques, linear
// in c, are fitted with the measured weight, so c doesn't depend on mounting errors.
//
// Drift and mounting errors are nuisance parameters, each with expected value 0, a standard deviation (Allowances) and
// a row in the least squares. The covariance is the inverse normal matrix, times χ²/ν if readings scatter by more than
// noise and allowances explain.
//
// The weight must vary in S by more than five times the mounting error (standard deviations): along one direction for
// mass and zero to be identifiable, along two for c.
#pragma once

#include <vector>

#include "models/geometry/geometry.hpp"

namespace proxarm::identification {

// The sensor's mean reading in a pose, and the mean's standard deviations.
struct PoseReading {
  models::Mat3 R_SW = models::Mat3::Identity();
  models::Wrench mean_S;
  double noise_N = 0.0, noise_Nm = 0.0;  // of each axis
  double tilt_rad = 0.0;                 // uncertainty of R_SW due to the gears
  double time_s = 0.0;                   // increasing
};

// Standard deviations of quantities that aren't measured.
struct Allowances {
  double mounting_rad = 0.0;  // of the sensor about each axis of S, and of the base about each of W
  double zero_drift_N = 0.0;  // drift of the zero from the first pose to the last, each axis; torques: times lever_m
};

// Converts a torque error to a force error: about a handle's length.
inline constexpr double lever_m = 0.1;
// Half of a 95 % interval, in standard deviations.
inline constexpr double deviations_of_95 = 1.959964;

// How well a model explains the readings.
struct Misfit {
  double chi_squared = 0.0, most = 0.0;  // without a hand, one session in 30,000 exceeds `most`
  int worst_pose = 0;
  double worst = 0.0, explained = 0.0;  // residual there, and its standard deviation: N or Nm

  [[nodiscard]] bool explained_all() const noexcept { return chi_squared <= most; }
};

// Each value with half of its 95 % interval.
struct ToolFit {
  bool mass_found = false, centre_found = false;
  double mass_kg = 0.0, mass_half_kg = 0.0;
  models::Vec3 centre_S_m = models::Vec3::Zero(), centre_half_m = models::Vec3::Zero();
  models::Wrench zero_S, zero_half_S;  // at the last pose
  double turned_rad = 0.0;             // |ε| + |δ| of the fit, the mounting errors
  Misfit force, torque;
};

// How much the direction of the weight in S varies over the poses: standard deviations along its principal axes, as
// shares of the weight, the largest first.
models::Vec3 spread(const std::vector<models::Mat3>& R_SW, const models::Vec3& gravity_W) noexcept;

// Whether this spread determines mass and zero, and the centre of mass.
[[nodiscard]] bool shows_mass(const models::Vec3& spread, const Allowances& allowances) noexcept;
[[nodiscard]] bool shows_centre(const models::Vec3& spread, const Allowances& allowances) noexcept;

// Precondition: noise or allowances are above 0, so that no reading counts as exact; gravity isn't 0. With fewer than
// three readings, or poses that determine nothing, the fit finds nothing.
ToolFit fit_tool(const std::vector<PoseReading>& readings, const models::Vec3& gravity_W, const Allowances& allowances);

}  // namespace proxarm::identification
