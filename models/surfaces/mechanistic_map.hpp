// Defines the forces ℳ that a 𝒢 stands for: (14), (16) and (17) as tests of membership, and the maps (9) and (12)
// between 𝒢 and ℳ as numerical checks.
//
//   ℳ(q, v) = f  s.t.  q = 𝒢(κ, q − f/κ, q − T v)  ∀ κ > 0                (9)
//   𝒢(κ, p, q) = r  s.t.  ℳ(r, (r − q)/T) = κ (r − p)                       (12)
//
// ℳ is set-valued. Therefore each law is written as a test that returns the distance of f from ℳ(q, v). `proxarm check`
// and the tests use it; the cycle doesn't use it.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "models/geometry/geometric_algorithm.hpp"
#include "models/surfaces/flat_surface.hpp"

namespace proxarm::models {

// The distance of a state (q, v, f) from f ∈ ℳ(q, v). Zero if f is a member; the caller chooses the tolerance.
struct MembershipError {
  double position_m = 0.0;  // depth of q behind the surface
  double force_N = 0.0;     // distance of f from the set ℳ(q, v)

  [[nodiscard]] bool within(double tolerance_m, double tolerance_N) const noexcept {
    return position_m <= tolerance_m && force_N <= tolerance_N;
  }
};

// Tolerances of the conditions "q is on the surface" and "q moves along the surface".
struct MembershipTolerance {
  double surface_m = 1e-12;     // q counts as on the surface if its height is at most this
  double motion_m_per_s = 0.0;  // the proxy counts as resting if ‖Nᵀv‖ is at most this
};

// Law (14): o if nᵀq > 0;  {f n | f > 0} if nᵀq = 0. Here the set is closed (f ≥ 0): contact without force is a member.
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

// Law (16): −F v/‖v‖ if v ≠ o;  {f | ‖f‖ ≤ F} if v = o.
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

// Law (17):
//   o                                              if nᵀq > 0
//   {f (n − μ N Nᵀv/‖Nᵀv‖) | f > 0}                if nᵀq = 0 ∧ Nᵀv ≠ o
//   {f (n − μ t) | f > 0, tᵀn = 0, ‖t‖ ≤ 1}        if nᵀq = 0 ∧ Nᵀv = o
// Since N Nᵀ = I − n nᵀ, the code doesn't need N itself. Here the set is closed (f ≥ 0). For N = 1 no tangent exists,
// and (17) equals (14).
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
    // The excess of the tangential force, which is at most √(1 + μ²) times the distance of f from the cone. For a force
    // that pulls, the distance is ‖f‖.
    const double at_rest = f_n < 0.0 ? f.norm() : std::max(0.0, f_t.norm() - mu_ * f_n);
    const double speed = v_t.norm();
    const double moving = speed > 0.0 ? slip_error(f_n, f_t, v_t / speed, f) : at_rest;
    return {std::max(0.0, -height), speed <= zero_.motion_m_per_s ? std::min(at_rest, moving) : moving};
  }

 private:
  // Returns the distance of f from the half-line {f (n − μ t)}.
  double slip_error(double f_n, const Vec<N>& f_t, const Vec<N>& t, const Vec<N>& f) const noexcept {
    return f_n < 0.0 ? f.norm() : (f_t + mu_ * f_n * t).norm();
  }

  FlatSurface<N> surface_;
  double mu_;
  MembershipTolerance zero_;
};

// Tests map (12): r = 𝒢(κ, p, q) must satisfy κ (r − p) ∈ ℳ(r, (r − q)/T). Returns the error of membership.
template <int N, typename Law>
MembershipError map_12_error(GeometricAlgorithm<N>& g, const Law& law, double kappa, const Vec<N>& p, const Vec<N>& q,
                             double period_s) {
  const Vec<N> r = g(kappa, p, q);
  return law(r, (r - q) / period_s, kappa * (r - p));
}

// Tests map (9), which is Assumption 1 at the state (r, q, f). Returns the greatest ‖𝒢(κ, r − f/κ, q) − r‖ over the
// given κ, in metres: zero (within rounding) if f ∈ ℳ(r, (r − q)/T).
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

// Returns the error (m) in map (9) that rounding alone can cause, for a state that was found with stiffness K:
//   64 ε [(‖r‖ + ‖q‖)(1 + K/κ) + ‖f‖/κ].
// The coordinates of r have a rounding error, f = K (r − p) has K times this error, and f/κ is rounded again.
template <int N>
double map_9_rounding(const Vec<N>& r, const Vec<N>& q, const Vec<N>& f, double K, double kappa) {
  constexpr double eps = std::numeric_limits<double>::epsilon();
  return 64.0 * eps * ((r.norm() + q.norm()) * (1.0 + K / kappa) + f.norm() / kappa);
}

}  // namespace proxarm::models
