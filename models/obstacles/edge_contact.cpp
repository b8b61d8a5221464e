#include "models/obstacles/edge_contact.hpp"

#include <cmath>
#include <limits>
#include <numbers>

namespace proxarm::models {

EdgeContact hold_at_edge(const Vec3& point, const Vec3& normal_1, const Vec3& normal_2,
                         const StepOnPlanes& step) noexcept {
  constexpr double u = 0.5 * std::numeric_limits<double>::epsilon();
  const double nothing = 4.0 * u * (point.lpNorm<1>() + step.q.lpNorm<1>());
  EdgeContact out{point, normal_1};
  // Returns how far the step on the plane with normal n(θ) ends beyond the edge, towards the side of the second face.
  // Stores the end of the step, moved to the edge, in `out`.
  const auto beyond = [&](double theta) {
    out.normal = std::cos(theta) * normal_1 + std::sin(theta) * normal_2;
    const Vec3 across = std::cos(theta) * normal_2 - std::sin(theta) * normal_1;
    const FaceStep<3> s = step.on(FlatSurface<3>::of_unit(point, out.normal));
    const double error = across.dot(s.r - point);
    out.r = s.r - error * across;
    out.slips = s.slips;
    return error;
  };
  constexpr int parts = 8;
  constexpr double part = 0.5 * std::numbers::pi / parts;
  out.found = false;
  for (int k = 0; k < parts && !out.found; ++k) {
    out.found = false_position(beyond, part * k, part * (k + 1), nothing, 64.0 * nothing);
  }
  return out;
}

// The normal n at the corner follows from (17):
// 1. The force f is along r − p, and the slip is d = r − q.
// 2. (17) says f/‖f‖ = cos β n − sin β v/‖v‖, with tan β = μ, where v is the part of d perpendicular to n.
// 3. So n is the direction of f, turned by β towards the part of d perpendicular to f.
EdgeContact hold_at_corner(const Vec3& r, double mu, const Vec3& p, const Vec3& q) noexcept {
  const Vec3 force = (r - p).normalized(), d = r - q;
  const double cos = 1.0 / std::sqrt(1.0 + mu * mu), sin = mu * cos;
  // Cosine of the angle between f and the direction from r back to q.
  const double against = -force.dot(d) / d.norm();
  if (against >= cos) return {r, -d.normalized()};
  const Vec3 aside = (d - force * force.dot(d)).normalized();
  return {r, cos * force + sin * aside, mu > 0.0};
}

}  // namespace proxarm::models
