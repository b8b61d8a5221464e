#include "scenes/compile.hpp"

#include <limits>

#include "models/coulomb_field.hpp"
#include "models/description/setup_error.hpp"
#include "models/embedded.hpp"
#include "models/free_space.hpp"
#include "models/friction_plane.hpp"
#include "models/plane.hpp"
#include "models/plane_composition.hpp"

namespace proxarm::scenes {
namespace {

using description::number_text;
using description::SetupError;
using models::Vec;
using models::Vec3;

// A plane of W cut by the proxy's space: a half-space of fewer dimensions, or nothing.
template <int N>
struct Cut {
  bool nothing = false;
  Vec<N> point = Vec<N>::Zero();
  Vec<N> normal = Vec<N>::Zero();
};

// n_Wᵀ(origin + A ξ − point_W) ≥ 0 in coordinates ξ: the normal is Aᵀn_W, not of length one where the cut is oblique.
template <int N>
Cut<N> cut(const Scene& scene, const Object& object, const PlaneShape& plane) {
  if constexpr (N == 3) {
    if (scene.space.axes.isIdentity(0.0) && scene.space.origin_m.isZero(0.0)) {
      return {.point = plane.point_m, .normal = plane.normal};
    }
  }
  const auto A = scene.space.axes.leftCols<N>();
  const Vec3 n = plane.normal.normalized();
  const Vec<N> m = A.transpose() * n;
  const Vec<N> near = A.transpose() * (plane.point_m - scene.space.origin_m);
  const double height = n.dot(scene.space.origin_m + A * near - plane.point_m);
  // A space that is parallel to the plane within rounding of both meets it nowhere or lies in it.
  if (m.norm() < 1e-12) {
    if (height >= 0.0) return {.nothing = true};
    throw SetupError({.file = scene.file.string(),
                      .line = object.line,
                      .message = "the proxy's space lies inside the object " + object.name,
                      .advice = "move `space` or the object"});
  }
  return {.point = near - m * (height / m.squaredNorm()), .normal = m};
}

template <int N>
using Planes = std::vector<std::pair<const Object*, Cut<N>>>;

template <int N>
std::unique_ptr<models::GeometricAlgorithm<N>> compose(const Planes<N>& planes, CompiledScene& out) {
  std::vector<models::Face> faces;
  bool friction = false;
  for (const auto& [object, half_space] : planes) {
    const double mu = N > 1 ? object->friction : 0.0;
    friction = friction || mu > 0.0;
    faces.push_back({models::FlatSurface<3>(models::Embedded<N>::lift(half_space.point),
                                            models::Embedded<N>::lift(half_space.normal)),
                     mu});
  }
  out.stages.push_back(
      {"composition of " + std::to_string(faces.size()) + " planes" + (friction ? " with friction" : ""),
       "sets of at most three contacts, solved directly"});
  if (!friction) out.skipped.push_back({"friction", "μ = 0 everywhere"});
  out.skipped.push_back({"motion", "nothing moves"});
  auto space = std::make_unique<models::PlaneComposition>(std::move(faces));
  if constexpr (N == 3) {
    return space;
  } else {
    return std::make_unique<models::Embedded<N>>(std::move(space));
  }
}

template <int N>
std::unique_ptr<models::GeometricAlgorithm<N>> build(const Scene& scene, CompiledScene& out) {
  Planes<N> planes;
  for (const Object& object : scene.objects) {
    const Cut<N> half_space = cut<N>(scene, object, std::get<PlaneShape>(object.shape));
    if (half_space.nothing) {
      out.skipped.push_back({object.name, "doesn't meet the proxy's space"});
    } else {
      planes.emplace_back(&object, half_space);
    }
  }
  if (!planes.empty() && scene.coulomb_force_N) {
    throw SetupError({.file = scene.file.string(),
                      .line = scene.coulomb_line,
                      .key = "coulomb_field",
                      .found = "a field together with objects",
                      .expected = "either"});
  }
  if (scene.coulomb_force_N) {
    out.stages.push_back(
        {"Coulomb field, equation (3)", "coulomb_field of " + number_text(*scene.coulomb_force_N) + " N"});
    out.skipped.push_back({"contacts", "no objects"});
    return std::make_unique<models::CoulombField<N>>(*scene.coulomb_force_N);
  }
  if (planes.empty()) {
    out.stages.push_back({"free space, q = p", "nothing to touch"});
    out.skipped.push_back({"contacts", "no objects"});
    out.skipped.push_back({"friction", "no objects"});
    return std::make_unique<models::FreeSpace<N>>();
  }
  if (planes.size() > 1) return compose<N>(planes, out);
  const auto& [object, half_space] = planes.front();
  out.skipped.push_back({"composition", "a single object"});
  out.skipped.push_back({"motion", "nothing moves"});
  if (object->friction > 0.0 && N > 1) {
    out.stages.push_back({"wall with friction, equation (4)", object->name + ", μ = " + number_text(object->friction)});
    return std::make_unique<models::FrictionPlane<N>>(half_space.point, half_space.normal, object->friction);
  }
  out.stages.push_back({"wall, equation (2)", object->name});
  out.skipped.push_back({"friction", object->friction > 0.0 ? "a line has no tangent to slip along" : "μ = 0"});
  return std::make_unique<models::Plane<N>>(half_space.point, half_space.normal);
}

double distance(const PlaneShape& plane, const Vec3& x) { return plane.normal.normalized().dot(x - plane.point_m); }

}  // namespace

CompiledScene compile(const Scene& scene) {
  CompiledScene out;
  out.name = scene.name;
  out.space = scene.space;
  switch (scene.space.dimensions) {
    case 1:
      out.any_algorithm = build<1>(scene, out);
      break;
    case 2:
      out.any_algorithm = build<2>(scene, out);
      break;
    default:
      out.any_algorithm = build<3>(scene, out);
      break;
  }
  return out;
}

double clearance_m(const Scene& scene, const Vec3& x_W) {
  double least = std::numeric_limits<double>::infinity();
  for (const Object& object : scene.objects) {
    least = std::min(least, std::visit([&](const auto& shape) { return distance(shape, x_W); }, object.shape));
  }
  return least;
}

}  // namespace proxarm::scenes
