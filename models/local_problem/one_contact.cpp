// Solves the local problem of a single contact, which most steps have, without a system of six unknowns.
//
// With W = H Hᵀ (3 × 3) and y = Hᵀ f, the displacement is u = W f + b. There are three cases:
// 1. The contact is open if b_n ≥ 0.
// 2. It sticks if f = −W⁻¹ b lies in the cone.
// 3. Otherwise it slips along a unit vector d. Then f_t = −μ f_n d, and u_n = 0 gives f_n = −b_n/(W_nn − μ W_ntᵀ d).
//    One equation is left for the angle of d, u_tᵀ d⊥ = 0, which Newton's method solves.
//
// The result must pass the test of the law like any other solution. If it fails, or if several solutions may exist
// (Painlevé: W_nn ≤ μ ‖W_nt‖), the general method continues from the guess.
#include <cmath>

#include "models/local_problem/contact_problem.hpp"

namespace proxarm::models {
namespace {

using Vec2 = Eigen::Vector2d;

// Newton's method doubles the number of exact digits in each step. If d has turned by less than this (rad), the next
// turn would be below rounding.
constexpr double kTurned = 1e-8;
constexpr int kMostTurns = 12;

// Returns the force of a contact that slips; zero if no direction d was found.
Vec3 slipping_force(const Mat3& W, const Vec3& b, double mu, const Vec3& guess) noexcept {
  const Vec2 W_nt = W.col(0).tail<2>(), b_t = b.tail<2>();
  const Eigen::Matrix2d W_tt = W.bottomRightCorner<2, 2>();
  Vec2 d = -guess.tail<2>();
  if (d.isZero(0.0)) d = b_t - b[0] / W(0, 0) * W_nt;
  d.normalize();
  for (int k = 0; k < kMostTurns; ++k) {
    const Vec2 across(-d.y(), d.x());
    const double yields = W(0, 0) - mu * W_nt.dot(d), f_n = -b[0] / yields;
    const Vec2 per_newton = W_nt - mu * (W_tt * d), u_t = b_t + f_n * per_newton;
    const double f_n_slope = f_n * mu * W_nt.dot(across) / yields;
    const double slope = across.dot(f_n_slope * per_newton - f_n * mu * (W_tt * across)) - d.dot(u_t);
    const double turn = -across.dot(u_t) / slope;
    if (!(std::abs(turn) < 1.0)) return Vec3::Zero();
    d = (d + turn * across).normalized();
    if (std::abs(turn) > kTurned) continue;
    const double force = -b[0] / (W(0, 0) - mu * W_nt.dot(d));
    const Vec2 friction = -mu * force * d;
    return {force, friction.x(), friction.y()};
  }
  return Vec3::Zero();
}

}  // namespace

bool ContactProblem::one_contact(Row& row, Twist& y, double size, double tolerance) noexcept {
  const Vec3 guess = row.f;
  row.f.setZero();
  row.state = ContactState::open;
  y.setZero();
  if (row.b[0] >= 0.0) return true;
  const Mat3 W = row.H * row.H.transpose();
  if (W(0, 0) > row.mu * W.col(0).tail<2>().norm()) {
    row.f = -(W.inverse() * row.b);
    row.state = ContactState::stick;
    if (!(row.f.tail<2>().norm() <= row.mu * row.f[0])) {
      row.state = ContactState::slip;
      row.f = row.mu > 0.0 ? slipping_force(W, row.b, row.mu, guess) : Vec3(-row.b[0] / W(0, 0), 0.0, 0.0);
    }
    y = row.H.transpose() * row.f;
    if (row.f[0] > 0.0 && violation({&row, 1}, y) <= tolerance * size) return true;
  }
  row.f = guess;
  return false;
}

}  // namespace proxarm::models
