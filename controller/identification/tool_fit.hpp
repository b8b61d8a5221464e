// Mass, centre of mass and zero of the sensor from its readings in poses at rest, with their uncertainty.
//
// At rest in pose k, with all vectors but g and δ in S:
//   F_k = b + d s_k + m R(ε) R_SW(k) R(δ) g      b: the zero at the last pose; d: its drift
//   τ_k = b' + d' s_k + c × (F_k − b − d s_k)    s_k: time before the last pose, from −1 (the first) to 0
// The rotation vectors ε and δ turn the sensor against its flange and the base against the vertical: mounting errors.
// The forces are fitted first (Gauss-Newton from m and b alone, since m multiplies ε and δ), then the torques, which
// are linear in c. The weight in them is the one that was read, so c is independent of mounting errors.
//
// Drift and mounting errors aren't wanted but not known either: each is an unknown with an expected value of 0 and a
// stated standard deviation (Allowances), a row of its own in the least squares. The covariance is the inverse of the
// normal matrix, larger by χ²/ν where readings scatter by more than noise and allowances explain.
//
// A direction of S along which the weight never changed by more than five times the mounting error shows nothing. Along
// one such direction c isn't identifiable; if there is no other, neither is anything else.
#pragma once

#include <vector>

#include "models/geometry/geometry.hpp"

namespace proxarm::identification {

// What the sensor read in a pose: the mean, and the standard deviations to which the mean is known.
struct PoseReading {
  models::Mat3 R_SW = models::Mat3::Identity();
  models::Wrench mean_S;
  double noise_N = 0.0, noise_Nm = 0.0;  // of each axis
  double tilt_rad = 0.0;                 // by which R_SW may be off: gears
  double time_s = 0.0;                   // rising
};

// Standard deviations of what is not measured.
struct Allowances {
  double mounting_rad = 0.0;  // of the sensor about each axis of S, and of the base about each of W
  double zero_drift_N = 0.0;  // of the zero from the first pose to the last, each axis; torques: times lever_m
};

// A torque's error counts as the force that makes it at this lever: about a handle's length.
inline constexpr double lever_m = 0.1;
// Half of a 95 % interval, in standard deviations.
inline constexpr double deviations_of_95 = 1.959964;

// How well a model explains what was read.
struct Misfit {
  double chi_squared = 0.0, most = 0.0;  // beyond `most` in one of 30,000 sessions without a hand
  int worst_pose = 0;
  double worst = 0.0, explained = 0.0;  // what is left over there, and one standard deviation of it: N or Nm

  [[nodiscard]] bool explained_all() const noexcept { return chi_squared <= most; }
};

// Each value with half of its 95 % interval.
struct ToolFit {
  bool mass_found = false, centre_found = false;
  double mass_kg = 0.0, mass_half_kg = 0.0;
  models::Vec3 centre_S_m = models::Vec3::Zero(), centre_half_m = models::Vec3::Zero();
  models::Wrench zero_S, zero_half_S;  // when the last pose was read
  double turned_rad = 0.0;             // |ε| + |δ|, the mounting errors that fit best
  Misfit force, torque;
};

// By how much the direction of the weight in S varies over the poses: standard deviations along its principal axes, as
// shares of the weight, the largest first.
models::Vec3 spread(const std::vector<models::Mat3>& R_SW, const models::Vec3& gravity_W) noexcept;

// Whether that shows the mass and the zero, and the centre of mass.
[[nodiscard]] bool shows_mass(const models::Vec3& spread, const Allowances& allowances) noexcept;
[[nodiscard]] bool shows_centre(const models::Vec3& spread, const Allowances& allowances) noexcept;

// Precondition: noise or allowances are above 0, so that no reading is taken for exact; gravity isn't 0. Fewer than
// three readings, or poses that show nothing, give a fit in which nothing is found.
ToolFit fit_tool(const std::vector<PoseReading>& readings, const models::Vec3& gravity_W, const Allowances& allowances);

}  // namespace proxarm::identification
