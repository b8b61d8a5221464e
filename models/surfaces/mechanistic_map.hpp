// The forces that a 𝒢 stands for: ℳ of (14), (16), (17) as set-membership tests, and the maps (9) and (12) between 𝒢
// and ℳ as numerical checks.
//
//   ℳ(q, v) = f  s.t.  q = 𝒢(κ, q − f/κ, q − T v)  ∀ κ > 0                (9)
//   𝒢(κ, p, q) = r  s.t.  ℳ(r, (r − q)/T) = κ (r − p)                       (12)
//
// ℳ is set-valued, so it is written as a test: how far is f from ℳ(q, v)? `proxarm check` and the tests use it; the
// cycle doesn't.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "models/geometry/geometric_algorithm.hpp"
#include "models/surfaces/flat_surface.hpp"

namespace proxarm::models {

// How far a state (q, v, f) is from f ∈ ℳ(q, v). Zero for a member; the caller chooses the tolerance.
struct MembershipError {
  double position_m = 0.0;  // depth of q behind the surface
  double force_N = 0.0;     // distance of f from the set

  [[nodiscard]] bool within(double tolerance_m, double tolerance_N) const noexcept {
    return position_m <= tolerance_m && force_N <= tolerance_N;
  }
};

// Tolerances for "q is on the surface" and "q moves along it".
struct MembershipTolerance {
  double surface_m = 1e-12;     // height up to which q is on the surface
  double motion_m_per_s = 0.0;  // ‖Nᵀv‖ up to which the proxy counts as resting
};

// (14): o if nᵀq > 0;  {f n | f > 0} if nᵀq = 0. Here the set is closed (f ≥ 0): touching without force is a member.
template <int N>
class WallLaw {
 public:
  explicit WallLaw(const FlatSurface<N>& surface, MembershipTolerance zero = {}) : surface_(surface), zero_(zero) {}

  [[nodiscard]] MembershipError operator()(const Vec<N>& q, const Vec<N>& /*v*/, const Vec<N>& f) const noexcept {
    const double height = surface_.height(q);
    if (height > zero_.surface_m) return {0.0, f.norm()};
    const double f_n = std::max(0.0, surface_.normal().dot(f));
    return {std::max(0.0, -height), (f - f_n * surface_.normal()).norm()};
  }

 private:
  FlatSurface<N> surface_;
  MembershipTolerance zero_;
};

// (16): −F v/‖v‖ if v ≠ o;  {f | ‖f‖ ≤ F} if v = o.
template <int N>
class CoulombLaw {
 public:
  explicit CoulombLaw(double force_N, MembershipTolerance zero = {}) : F_(force_N), zero_(zero) {}

  [[nodiscard]] MembershipError operator()(const Vec<N>& /*q*/, const Vec<N>& v, const Vec<N>& f) const noexcept {
    const double speed = v.norm();
    const double at_rest = std::max(0.0, f.norm() - F_);
    const double moving = speed > 0.0 ? (f + F_ / speed * v).norm() : at_rest;
    return {0.0, speed <= zero_.motion_m_per_s ? std::min(at_rest, moving) : moving};
  }

 private:
  double F_;
  MembershipTolerance zero_;
};

// (17): o                                              if nᵀq > 0
//       {f (n − μ N Nᵀv/‖Nᵀv‖) | f > 0}                if nᵀq = 0 ∧ Nᵀv ≠ o
//       {f (n − μ t) | f > 0, tᵀn = 0, ‖t‖ ≤ 1}        if nᵀq = 0 ∧ Nᵀv = o
// N Nᵀ = I − n nᵀ, so N itself is never needed. Closed like (14). For N = 1 there is no tangent, and this is (14).
template <int N>
class FrictionWallLaw {
 public:
  FrictionWallLaw(const FlatSurface<N>& surface, double friction, MembershipTolerance zero = {})
      : surface_(surface), mu_(friction), zero_(zero) {}

  [[nodiscard]] MembershipError operator()(const Vec<N>& q, const Vec<N>& v, const Vec<N>& f) const noexcept {
    const double height = surface_.height(q);
    if (height > zero_.surface_m) return {0.0, f.norm()};
    const Vec<N>& n = surface_.normal();
    const double f_n = n.dot(f);
    const Vec<N> f_t = f - f_n * n, v_t = v - n * n.dot(v);
    // Excess of the tangential force: the distance from the cone, overestimated by a factor of at most √(1 + μ²). A
    // pulling force counts in full.
    const double at_rest = f_n < 0.0 ? f.norm() : std::max(0.0, f_t.norm() - mu_ * f_n);
    const double speed = v_t.norm();
    const double moving = speed > 0.0 ? slip_error(f_n, f_t, v_t / speed, f) : at_rest;
    return {std::max(0.0, -height), speed <= zero_.motion_m_per_s ? std::min(at_rest, moving) : moving};
  }

 private:
  // Distance from the half-line {f (n − μ t)}.
  double slip_error(double f_n, const Vec<N>& f_t, const Vec<N>& t, const Vec<N>& f) const noexcept {
    return f_n < 0.0 ? f.norm() : (f_t + mu_ * f_n * t).norm();
  }

  FlatSurface<N> surface_;
  double mu_;
  MembershipTolerance zero_;
};

// Map (12) as a test: r = 𝒢(κ, p, q) must satisfy κ (r − p) ∈ ℳ(r, (r − q)/T).
template <int N, typename Law>
MembershipError map_12_error(GeometricAlgorithm<N>& g, const Law& law, double kappa, const Vec<N>& p, const Vec<N>& q,
                             double period_s) {
  const Vec<N> r = g(kappa, p, q);
  return law(r, (r - q) / period_s, kappa * (r - p));
}

// Map (9) as a test, which is Assumption 1 at the state (r, q, f): the greatest ‖𝒢(κ, r − f/κ, q) − r‖ over the given
// κ, metres. Zero (within rounding) for every κ if f ∈ ℳ(r, (r − q)/T).
template <int N>
double map_9_error(GeometricAlgorithm<N>& g, const Vec<N>& r, const Vec<N>& q, const Vec<N>& f,
                   std::span<const double> kappas) {
  double worst = 0.0;
  for (const double kappa : kappas) {
    const Vec<N> r_kappa = g(kappa, r - f / kappa, q);
    const double error = (r_kappa - r).norm();
    if (!(error <= worst)) worst = std::isfinite(error) ? error : std::numeric_limits<double>::infinity();
  }
  return worst;
}

// The error (m) in map (9) that rounding alone can cause, for a state found with stiffness K:
//   64 ε [(‖r‖ + ‖q‖)(1 + K/κ) + ‖f‖/κ].
// r carries the rounding of its coordinates, f = K (r − p) carries K times that error, and f/κ is rounded again.
template <int N>
double map_9_rounding(const Vec<N>& r, const Vec<N>& q, const Vec<N>& f, double K, double kappa) {
  constexpr double eps = std::numeric_limits<double>::epsilon();
  return 64.0 * eps * ((r.norm() + q.norm()) * (1.0 + K / kappa) + f.norm() / kappa);
}

}  // namespace proxarm::models
