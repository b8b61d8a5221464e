// Where objects that move are, and the law against what they carry along, by formulas that RigidWorld doesn't have.
#pragma once

#include <numbers>
#include <optional>
#include <span>
#include <vector>

#include "models/rigid_features/rigid_object.hpp"
#include "tests/models/rigid_judges/rigid_judge.hpp"

namespace proxarm::models {

// The matrix of Rodrigues' formula, and the place of the script's text: c + R(ωt)(x − c) + vt + a sin(2πft + φ).
inline Pose place(const std::optional<RigidMotion>& motion, double t) {
  Pose X = Pose::Identity();
  if (!motion || motion->driven) return X;
  const ScriptedMotion& m = motion->script;
  Mat3 k;
  k << 0.0, -m.axis.z(), m.axis.y(), m.axis.z(), 0.0, -m.axis.x(), -m.axis.y(), m.axis.x(), 0.0;
  const double angle = m.turn_rad_per_s * t;
  X.linear() = Mat3::Identity() + std::sin(angle) * k + (1.0 - std::cos(angle)) * k * k;
  X.translation() = m.centre_m - X.linear() * m.centre_m + m.velocity_m_per_s * t +
                    m.amplitude_m * std::sin(2.0 * std::numbers::pi * m.frequency_Hz * t + m.phase_rad);
  return X;
}

// The law against objects whose places before and after the step are given.
inline LawFigures judge_moving(std::span<const PoseContact> contacts, const Mat6& K, const ToolPose& p_hat,
                               const ToolPose& q_old, const ToolPose& q, const std::vector<double>& mu,
                               const std::vector<Pose>& before, const std::vector<Pose>& after) {
  LawFigures out;
  Twist sum = Twist::Zero();
  double size = 0.0;
  for (const PoseContact& contact : contacts) size = std::max(size, contact.force_W.norm());
  for (const PoseContact& contact : contacts) {
    const auto i = static_cast<std::size_t>(contact.object);
    const Vec3 &f = contact.force_W, &n = contact.normal_W;
    sum.head<3>() += f;
    sum.tail<3>() += (contact.point_W - q.position).cross(f);
    const double f_n = n.dot(f), limit = mu[i] * f_n;
    const Vec3 f_t = f - f_n * n;
    out.pull = std::max(out.pull, -f_n / size);
    out.outside_cone = std::max(out.outside_cone, (f_t.norm() - limit) / size);
    if (f_n > 1e-9 * size) out.gap_m = std::max(out.gap_m, std::abs(contact.gap_m));
    const Vec3 own = q.orientation.conjugate() * (contact.point_W - q.position);
    const Vec3 way_O = after[i].inverse() * contact.point_W - before[i].inverse() * (q_old * own);
    const Vec3 slip = after[i].linear() * way_O, s = slip - n * n.dot(slip);
    if (s.norm() > 1e-12) out.against_slip = std::max(out.against_slip, (f_t + limit * s.normalized()).norm() / size);
  }
  const Twist w = K * difference(q, p_hat);
  out.imbalance = (sum - w).norm() / std::max(w.norm(), 1e-300);
  return out;
}

}  // namespace proxarm::models
