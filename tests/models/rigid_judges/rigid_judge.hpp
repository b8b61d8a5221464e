// Judges of a step that share no code with it: the separation of two convex polyhedra by all of their axes, and the law
// that contacts must keep.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "models/base/random.hpp"
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

// The convex hull of some points. All planes through three of them that leave the others on one side, and all pairs as
// edges: more axes than needed find no more than the separation.
inline Polyhedron polyhedron_of_hull(const std::vector<Vec3>& points) {
  Polyhedron hull;
  hull.corners = points;
  for (const Vec3& a : points) {
    for (const Vec3& b : points) {
      if (&a >= &b) continue;
      hull.edges.push_back((b - a).normalized());
      for (const Vec3& c : points) {
        const Vec3 n = (b - a).cross(c - a).normalized();
        const bool over =
            std::any_of(points.begin(), points.end(), [&](const Vec3& x) { return n.dot(x - a) > 1e-12; });
        if (&b != &c && &a != &c && !over) hull.normals.push_back(n);
      }
    }
  }
  return hull;
}

inline Polyhedron at(const Polyhedron& body, const ToolPose& pose) {
  Polyhedron out = body;
  for (Vec3& x : out.corners) x = pose * x;
  for (Vec3& n : out.normals) n = pose.orientation * n;
  for (Vec3& e : out.edges) e = pose.orientation * e;
  return out;
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
  double against_slip = 0.0;  // what friction misses of μ f_n against the slip, over the force
  double pull = 0.0;          // a normal force below 0
  double gap_m = 0.0;         // of a contact that presses

  void take(const LawFigures& other) {
    imbalance = std::max(imbalance, other.imbalance);
    outside_cone = std::max(outside_cone, other.outside_cone);
    against_slip = std::max(against_slip, other.against_slip);
    pull = std::max(pull, other.pull);
    gap_m = std::max(gap_m, other.gap_m);
  }
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
    // Places of a tool within half a metre are known to a femtometre, and so is a slip; and the local problem is solved
    // to 1e-10 of the free motion's press, which at a lever is ten times that of the way to p̂.
    const double known = 1e-15 + 1e-9 * difference(q, p_hat).head<3>().norm();
    const double off = (f_t + limit * s.normalized()).norm() - limit * known / s.norm();
    if (s.norm() > 1e-12) out.against_slip = std::max(out.against_slip, off / size);
  }
  const Twist w = K * difference(q, p_hat);
  // Force and torque are compared as they are: N and Nm, at levers of some centimetres. A place is known to half a unit
  // in its last place, which is so much force: 4e-11 N at 0.1 m and 4 N/µm. What presses with hundredths of a newton
  // isn't balanced to ten digits of that.
  const double rounding = 0.5 * std::numeric_limits<double>::epsilon() * (K.topLeftCorner<3, 3>() * q.position).norm();
  out.imbalance = std::max((sum - w).norm() - rounding, 0.0) / std::max(w.norm(), 1e-300);
  return out;
}

// Of the wrench, over the largest force: in a wedge the forces hold each other and are far larger than their sum.
inline double imbalance(std::span<const PoseContact> contacts, const Mat6& K, const ToolPose& p_hat,
                        const ToolPose& q) {
  Twist off = -(K * difference(q, p_hat));
  double size = off.norm();
  for (const PoseContact& contact : contacts) {
    off.head<3>() += contact.force_W;
    off.tail<3>() += (contact.point_W - q.position).cross(contact.force_W);
    size = std::max(size, contact.force_W.norm());
  }
  return off.norm() / size;
}

// What steps in a world came to.
struct Pushed {
  int judged = 0, touching = 0, unresolved = 0;
  int jams = 0;  // unresolved steps in a row count as one
  bool jammed = false;
  double deepest = 0.0;
  LawFigures law;

  // A step, by how far the tool is from everything after it, and what judge() says of the law where it touches.
  template <typename Judge>
  void take(const PoseAlgorithm& g, double apart_m, Judge judge) {
    deepest = std::min(deepest, apart_m);
    ++judged;
    jams += g.unresolved() && !jammed ? 1 : 0;
    jammed = g.unresolved();
    if (g.unresolved()) {
      ++unresolved;
    } else if (!g.contacts().empty()) {
      ++touching;
      law.take(judge());
    }
  }
};

// Sends a tool about from a pose by up to 2 mm and 0.02 rad a step, towards `middle` or away from it, as a hand would.
// `apart` is how far it is from everything, of which the step knows nothing.
template <typename Apart>
void push_about(PoseAlgorithm& g, Random& random, ToolPose q, const Mat6& K, const std::vector<double>& mu, int steps,
                const Vec3& middle, bool outwards, Apart apart, Pushed& out) {
  Twist way = Twist::Zero();
  for (int k = 0; k < steps; ++k) {
    if (k % 20 == 0) {
      const Vec3 away = q.position - middle;
      const Vec3 towards = away.norm() > 1e-9 ? Vec3(away.normalized() * (outwards ? 1.0 : -1.0)) : random.direction();
      way.head<3>() = towards * random.log_uniform(1e-6, 2e-3);
      way.head<3>() += random.in_box(3e-4);
      way.tail<3>() = random.log_arrow(1e-5, 2e-2);
    }
    const ToolPose p = moved(q, way);
    const ToolPose r = g.step(K, p, q);
    out.take(g, apart(r), [&] { return judge_law(g.contacts(), K, p, q, r, mu); });
    q = r;
  }
}

inline void expect_law(const Pushed& out) {
  EXPECT_GE(out.deepest, -1e-12);
  EXPECT_GT(out.touching, 300) << "or else this looks at nothing";
  // At most one of 1,000 steps. Where a push jams, it does for all of its twenty steps, so of few steps jams are
  // counted, to three standard deviations of such a count.
  const double share = 1e-3 * out.judged;
  EXPECT_LE(out.jams, share + 3.0 * std::sqrt(share));
  EXPECT_LE(out.unresolved, (out.judged < 100'000 ? 10.0 : 1.0) * share);
  EXPECT_LE(out.law.imbalance, 1e-10);
  EXPECT_LE(out.law.outside_cone, 1e-12);
  EXPECT_LE(out.law.against_slip, 1e-8);
  EXPECT_EQ(out.law.pull, 0.0);
  EXPECT_LE(out.law.gap_m, 1e-12);
}

}  // namespace proxarm::models
