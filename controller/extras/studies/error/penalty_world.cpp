#include "controller/extras/studies/error/penalty_world.hpp"

#include <cmath>

namespace proxarm::studies {

using models::Mat3;
using models::Vec3;

// What a surface is for a point q: q's height above the surface (negative inside), the surface's normal n, and the
// factor in ∂n/∂q = bend (1 − n nᵀ).
struct PenaltyWorld::Touch {
  double height;
  Vec3 n;
  double bend;
};

PenaltyWorld::PenaltyWorld(const ErrorCase& which, const Tuning& tuning)
    : surfaces_(which.surfaces), mu_(which.friction), medium_(which.medium_Ns_per_m), k_(tuning.stiffness_N_per_m) {
  const double critical = 2.0 * std::sqrt(k_ * which.mass_kg);
  c_ = tuning.damping_ratio * critical;
  c_t_ = tuning.friction_slope * critical;
}

PenaltyWorld::Touch PenaltyWorld::touch(const CaseSurface& surface, const Vec3& q) noexcept {
  const Vec3 d = q - surface.point;
  if (surface.radius_m == 0.0) return {surface.normal.dot(d), surface.normal, 0.0};
  const double distance = d.norm();
  return {surface.radius_m - distance, -d / distance, -1.0 / distance};
}

Vec3 PenaltyWorld::force(const Vec3& q, const Vec3& v) const noexcept {
  Vec3 f = Vec3::Zero();
  for (const CaseSurface& surface : surfaces_) {
    const Touch at = touch(surface, q);
    if (at.height < 0.0) press(at, 0.0, v, f, nullptr);
  }
  if (medium_ > 0.0 && q.x() > 0.0) f -= medium_ * v;
  return f;
}

Vec3 PenaltyWorld::force(const Vec3& q_0, double T, const Vec3& v, Mat3& slope) const noexcept {
  const Vec3 q = q_0 + T * v;
  Vec3 f = Vec3::Zero();
  slope.setZero();
  for (const CaseSurface& surface : surfaces_) {
    const Touch at = touch(surface, q);
    if (at.height < 0.0) press(at, T, v, f, &slope);
  }
  if (medium_ > 0.0 && q.x() > 0.0) {
    f -= medium_ * v;
    slope.diagonal().array() -= medium_;
  }
  return f;
}

// Adds one surface's force to `f`, and the force's derivative with respect to v to `slope`. As q is q₀ + T v, ∂q/∂v =
// T, and so ∂n/∂v = T bend (1 − n nᵀ).
void PenaltyWorld::press(const Touch& at, double T, const Vec3& v, Vec3& f, Mat3* slope) const noexcept {
  const Vec3& n = at.n;
  const double v_n = n.dot(v), f_n = -k_ * at.height - c_ * v_n;
  if (f_n <= 0.0) return;
  f += f_n * n;
  const Vec3 v_t = v - v_n * n;
  const double speed = v_t.norm();
  const bool sticks = c_t_ * speed <= mu_ * f_n;
  if (mu_ > 0.0) f -= (sticks ? c_t_ : mu_ * f_n / speed) * v_t;
  if (slope == nullptr) return;

  const Mat3 across = Mat3::Identity() - n * n.transpose();
  const double turn = T * at.bend;
  const Vec3 f_n_by_v = -(k_ * T + c_) * n - c_ * turn * v_t;
  *slope += n * f_n_by_v.transpose() + f_n * turn * across;
  if (mu_ == 0.0) return;
  const Mat3 v_t_by_v = across - turn * (v_n * across + n * v_t.transpose());
  if (sticks) {
    *slope -= c_t_ * v_t_by_v;
  } else {
    const Vec3 e = v_t / speed;
    *slope -= mu_ * (e * f_n_by_v.transpose() + f_n / speed * (v_t_by_v - e * (e.transpose() * v_t_by_v)));
  }
}

}  // namespace proxarm::studies
