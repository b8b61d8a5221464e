// Judges of a step that share no code with it: the separation of two convex polyhedra by all of their axes, and the law
// that contacts must keep.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "models/geometry/pose_algorithm.hpp"

namespace proxarm::models {

// Corners in W, face normals and edge directions in W.
struct Polyhedron {
  std::vector<Vec3> corners, normals, edges;
};

inline Polyhedron polyhedron_of_box(const Vec3& size, const Pose& X) {
  Polyhedron box;
  for (int i = 0; i < 8; ++i) {
    box.corners.push_back(
        X * Vec3((i & 1 ? 0.5 : -0.5) * size.x(), (i & 2 ? 0.5 : -0.5) * size.y(), (i & 4 ? 0.5 : -0.5) * size.z()));
  }
  for (int k = 0; k < 3; ++k) {
    box.normals.push_back(X.linear().col(k));
    box.edges.push_back(X.linear().col(k));
  }
  return box;
}

// The separating axis theorem: the largest separation over all face normals and products of edges. It is the distance
// where the nearest features are a face's, and no larger than it otherwise; negative inside.
inline double separation(const Polyhedron& a, const Polyhedron& b) {
  std::vector<Vec3> axes = a.normals;
  axes.insert(axes.end(), b.normals.begin(), b.normals.end());
  for (const Vec3& x : a.edges) {
    for (const Vec3& y : b.edges) {
      if (x.cross(y).norm() > 1e-7) axes.push_back(x.cross(y).normalized());
    }
  }
  double best = -std::numeric_limits<double>::infinity();
  for (const Vec3& n : axes) {
    const auto range = [&](const Polyhedron& p) {
      double low = std::numeric_limits<double>::infinity(), high = -low;
      for (const Vec3& c : p.corners) {
        low = std::min(low, n.dot(c));
        high = std::max(high, n.dot(c));
      }
      return std::pair(low, high);
    };
    const auto [a_low, a_high] = range(a);
    const auto [b_low, b_high] = range(b);
    best = std::max({best, a_low - b_high, b_low - a_high});
  }
  return best;
}

struct LawFigures {
  double imbalance = 0.0;     // of the wrench, over its size
  double outside_cone = 0.0;  // of friction, over the force
  double against_slip =
      0.0;             // the angle's sine between friction and the slip that it opposes, and what it lacks of μ f_n
  double pull = 0.0;   // a normal force below 0
  double gap_m = 0.0;  // of a contact that presses
};

// Against the law as pose_algorithm.hpp states it, for objects that stand still. `mu` of each object.
inline LawFigures judge_law(std::span<const PoseContact> contacts, const Mat6& K, const ToolPose& p_hat,
                            const ToolPose& q_old, const ToolPose& q, const std::vector<double>& mu) {
  LawFigures out;
  Twist sum = Twist::Zero();
  double size = 0.0;
  for (const PoseContact& contact : contacts) size = std::max(size, contact.force_W.norm());
  for (const PoseContact& contact : contacts) {
    const Vec3 &f = contact.force_W, &n = contact.normal_W;
    sum.head<3>() += f;
    sum.tail<3>() += (contact.point_W - q.position).cross(f);
    const double f_n = n.dot(f), limit = mu[static_cast<std::size_t>(contact.object)] * f_n;
    const Vec3 f_t = f - f_n * n;
    out.pull = std::max(out.pull, -f_n / size);
    out.outside_cone = std::max(out.outside_cone, (f_t.norm() - limit) / size);
    if (f_n > 1e-9 * size) out.gap_m = std::max(out.gap_m, std::abs(contact.gap_m));
    const Vec3 was = q_old * (q.orientation.conjugate() * (contact.point_W - q.position));
    const Vec3 slip = contact.point_W - was, s = slip - n * n.dot(slip);
    if (s.norm() > 1e-12) out.against_slip = std::max(out.against_slip, (f_t + limit * s.normalized()).norm() / size);
  }
  const Twist w = K * difference(q, p_hat);
  // Force and torque are compared as they are: N and Nm, at levers of some centimetres.
  out.imbalance = (sum - w).norm() / std::max(w.norm(), 1e-300);
  return out;
}

}  // namespace proxarm::models
