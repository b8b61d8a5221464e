// How far a cylinder with flat ends is from another body, by formulas that share nothing with RigidWorld: a plane
// between the two, the best of all that may be.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "tests/models/rigid_judges/rigid_bodies.hpp"

namespace proxarm::models {

struct Can {
  Pose X = Pose::Identity();  // the axis is its z, about the middle
  double length = 0.0, radius = 0.0;
};

inline Can at(const Can& can, const Pose& X) { return {X * can.X, can.length, can.radius}; }

// All points within a radius of the hull of some. Edges by their ends.
struct Rounded {
  std::vector<Vec3> points, normals;
  std::vector<std::array<Vec3, 2>> edges;
  double radius = 0.0;
};

inline Rounded rounded(const Body& body) {
  Rounded out;
  out.radius = body.radius;
  const Vec3 half = 0.5 * body.size;
  for (int i = 0; i < 8; ++i) {
    const Vec3 sign(i & 1 ? 1.0 : -1.0, i & 2 ? 1.0 : -1.0, i & 4 ? 1.0 : -1.0);
    if ((half.array() == 0.0 && sign.array() > 0.0).any()) continue;
    out.points.push_back(body.X * Vec3(half.cwiseProduct(sign)));
    for (int k = 0; k < 3; ++k) {
      if (half[k] == 0.0 || sign[k] > 0.0) continue;
      Vec3 other = half.cwiseProduct(sign);
      other[k] = half[k];
      out.edges.push_back({out.points.back(), body.X * other});
    }
  }
  if (half.minCoeff() > 0.0) {
    for (int k = 0; k < 3; ++k) {
      out.normals.push_back(body.X.linear().col(k));
      out.normals.push_back(-body.X.linear().col(k));
    }
  }
  return out;
}

inline Rounded rounded(const std::array<Vec3, 3>& triangle) {
  Rounded out;
  const Vec3 n = (triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]).normalized();
  out.normals = {n, -n};
  for (std::size_t k = 0; k < 3; ++k) {
    out.points.push_back(triangle[k]);
    out.edges.push_back({triangle[k], triangle[(k + 1) % 3]});
  }
  return out;
}

// What a plane along n, out of the cylinder, leaves between the two.
inline double left_along(const Can& can, const Rounded& body, const Vec3& n) {
  const Vec3 z = can.X.linear().col(2);
  const double cosine = z.dot(n);
  double nearest = std::numeric_limits<double>::infinity();
  for (const Vec3& p : body.points) nearest = std::min(nearest, n.dot(p - can.X.translation()));
  return nearest - body.radius - 0.5 * can.length * std::abs(cosine) - can.radius * (n - cosine * z).norm();
}

// The largest of those across an edge, found by looking around it: it is smooth but for planes along the axis, so that
// an angle to 1e-8 is enough.
inline double left_across(const Can& can, const Rounded& body, const Vec3& d) {
  const Vec3 u = d.unitOrthogonal(), v = d.cross(u);
  const auto left = [&](double angle) { return left_along(can, body, std::cos(angle) * u + std::sin(angle) * v); };
  constexpr int around = 90;
  const double step = 2.0 * std::numbers::pi / around;
  double best = -std::numeric_limits<double>::infinity();
  std::array<double, around> values;
  for (int i = 0; i < around; ++i) values[static_cast<std::size_t>(i)] = left(i * step);
  for (int i = 0; i < around; ++i) {
    const auto value = [&](int k) { return values[static_cast<std::size_t>((k + around) % around)]; };
    if (value(i) < value(i - 1) || value(i) < value(i + 1)) continue;
    double low = (i - 1) * step, high = (i + 1) * step;
    for (int k = 0; k < 60; ++k) {
      const double x = low + (high - low) / 3.0, y = high - (high - low) / 3.0;
      (left(x) < left(y) ? low : high) = left(x) < left(y) ? x : y;
    }
    best = std::max(best, left(low));
  }
  const Vec3 along_axis = can.X.linear().col(2).cross(d);
  if (along_axis.norm() > 1e-9) {
    best = std::max(
        {best, left_along(can, body, along_axis.normalized()), left_along(can, body, -along_axis.normalized())});
  }
  return best;
}

inline double apart(const Can& can, const Rounded& body) {
  const Vec3 z = can.X.linear().col(2);
  double best = std::max(left_along(can, body, z), left_along(can, body, -z));
  for (const Vec3& n : body.normals) best = std::max(best, left_along(can, body, -n));
  for (const Vec3& p : body.points) {
    const Vec3 x = can.X.inverse() * p;
    const Vec3 across(x.x(), x.y(), 0.0), out = across.normalized();
    const Vec3 near = std::min(across.norm(), can.radius) * out +
                      Vec3(0.0, 0.0, std::clamp(x.z(), -0.5 * can.length, 0.5 * can.length));
    if (across.norm() > 0.0) best = std::max(best, left_along(can, body, can.X.linear() * out));
    if ((x - near).norm() > 0.0) best = std::max(best, left_along(can, body, can.X.linear() * (x - near).normalized()));
  }
  if (best > 1e-3) return best;  // far enough: nobody asks by how much
  for (const auto& [from, to] : body.edges) best = std::max(best, left_across(can, body, (to - from).normalized()));
  return best;
}

inline double furthest_along(const Can& can, const Vec3& n) {
  const Vec3 z = can.X.linear().col(2);
  const double cosine = z.dot(n);
  return n.dot(can.X.translation()) + 0.5 * can.length * std::abs(cosine) + can.radius * (n - cosine * z).norm();
}

inline Vec3 nearest_of(const Can& can, const Vec3& p) {
  const Vec3 x = can.X.inverse() * p;
  const double across = x.head<2>().norm(), share = across > can.radius ? can.radius / across : 1.0;
  return can.X * Vec3(share * x.x(), share * x.y(), std::clamp(x.z(), -0.5 * can.length, 0.5 * can.length));
}

// Of two: a plane that leaves more than nothing shows that they are apart. Tried are those along directions that
// somebody claims, where they touch, those of the axes, and that between two places that come nearest by turns.
inline double apart(const Can& a, const Can& b, const std::vector<Vec3>& claimed) {
  double best = -std::numeric_limits<double>::infinity();
  Vec3 best_along = Vec3::UnitZ();
  const auto left_along = [&](const Vec3& out) { return -furthest_along(b, -out) - furthest_along(a, out); };
  const auto try_along = [&](const Vec3& n) {
    const double before = best;
    if (!(n.norm() > 1e-12)) return false;
    for (const Vec3& out : {Vec3(n.normalized()), Vec3(-n.normalized())}) {
      const double left = left_along(out);
      if (left > best) best_along = out;
      best = std::max(best, left);
    }
    return best > before;
  };
  const Vec3 z_a = a.X.linear().col(2), z_b = b.X.linear().col(2);
  for (const Vec3& n : claimed) try_along(n);
  for (const Vec3& n : {z_a, z_b, Vec3(z_a.cross(z_b))}) try_along(n);
  if (best > 0.0) return best;
  Vec3 x = a.X.translation();
  for (int k = 0; k < 20000 && !(best > 0.0); ++k) {
    const Vec3 y = nearest_of(b, x);
    x = nearest_of(a, y);
    if (k % 50 == 0) try_along(y - x);
  }
  // Where they touch but nobody says along what: out of the side of either, about where they come nearest, or else
  // around the best one. (That search alone stalls where what is best is a ridge, as along a side.)
  for (const double sign : {1.0, -1.0}) {
    const Can& can = sign > 0.0 ? a : b;
    const Vec3 z = can.X.linear().col(2), away = x - can.X.translation(),
               out = sign * (away - z * z.dot(away)).normalized();
    const auto along = [&](double angle) { return Vec3(Eigen::AngleAxisd(angle, z) * out); };
    double low = -0.1, high = 0.1;
    for (int k = 0; k < 100; ++k) {
      const double third = (high - low) / 3.0;
      const bool rises = left_along(along(low + third)) < left_along(along(high - third));
      (rises ? low : high) += rises ? third : -third;
    }
    try_along(along(0.5 * (low + high)));
  }
  Random random(1);
  for (double step = 1e-2; step > 1e-14 && best < -1e-13; step *= 0.8) {
    for (int k = 0; k < 400; ++k) {
      if (try_along(best_along + step * random.direction())) k = 0;
    }
  }
  return best;
}

inline Solid solid_of_can(const Can& can) { return solid_of(CylinderTool{can.length, can.radius}, can.X); }

}  // namespace proxarm::models
