#include "controller/extras/studies/stress/stress_laws.hpp"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <variant>

#include "scenes/compiler/obstacles.hpp"

namespace proxarm::studies {
namespace {

using models::Contact;
using models::lift;
using models::Vec3;

constexpr double epsilon = std::numeric_limits<double>::epsilon();
constexpr double infinity = std::numeric_limits<double>::infinity();

bool is_convex(const models::TriangleMesh& mesh) {
  for (std::uint32_t face = 0; face < mesh.size(); ++face) {
    for (std::uint32_t other = 0; other < mesh.size(); ++other) {
      for (std::size_t k = 0; k < 3; ++k) {
        if (models::TriangleMesh::height(mesh.face(face), mesh.corner(other, k)) > 1e-12) return false;
      }
    }
  }
  return true;
}

// Returns the distance of x from a convex mesh, as the largest height of x over a face.
double convex_distance(const scenes::Object& object, const Vec3& x) {
  const models::TriangleMesh& mesh = *std::get<scenes::MeshShape>(object.shape).mesh;
  double highest = -infinity;
  for (std::uint32_t face = 0; face < mesh.size(); ++face) {
    highest = std::max(highest, models::TriangleMesh::height(mesh.face(face), x));
  }
  return highest;
}

// Returns the sum of the contacts' forces (N) if forces along the cones' axes add up to f and none of them pulls;
// otherwise 0. If slipping contacts press against each other, their forces may far exceed f, and multiply the rounding
// of the axes.
double squeeze(const Vec3& f, const std::vector<models::ForceCone>& cones) {
  if (cones.size() < 2 || cones.size() > 3) return 0.0;
  Eigen::Matrix3d axes = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < cones.size(); ++i) {
    if (cones[i].mu > 0.0) return 0.0;
    axes.col(static_cast<Eigen::Index>(i)) = cones[i].axis;
  }
  const Vec3 forces = axes.completeOrthogonalDecomposition().solve(f);
  return forces.minCoeff() >= 0.0 ? forces.sum() : 0.0;
}

}  // namespace

Laws::Laws(const scenes::Scene& scene) : scene_(scene) {
  for (const scenes::Object& object : scene.objects) {
    moving_ = moving_ || object.motion.has_value();
    scripts_.push_back(object.motion ? scenes::script_of(*object.motion) : models::ScriptedMotion{});
    const auto* mesh = std::get_if<scenes::MeshShape>(&object.shape);
    meshes_ = meshes_ || mesh != nullptr;
    convex_.push_back(mesh != nullptr && is_convex(*mesh->mesh));
  }
}

bool Laws::soft() const noexcept {
  return std::any_of(scene_.objects.begin(), scene_.objects.end(),
                     [](const scenes::Object& object) { return object.layer.has_value(); });
}

template <int N>
Laws::ObjectForce Laws::without_media(const Call<N>& call) const {
  double coulomb_N = scene_.coulomb_force_N.value_or(0.0);
  double b = 0.0;
  for (const scenes::MediumDescription& medium : scene_.media) {
    if (medium.within) {
      const auto& ball = std::get<scenes::SphereShape>(*medium.within);
      if ((lift<N>(call.q) - ball.centre_m).norm() > ball.radius_m) continue;
    }
    b += medium.damping_Ns_per_m;
    coulomb_N += medium.force_N;
  }
  return {lift<N>(call.f() + b / call.time.period_s * (call.r - call.q)), coulomb_N, call.K + b / call.time.period_s};
}

template <int N>
bool Laws::obeyed(const Call<N>& call) const {
  if (!judged()) return true;
  const ObjectForce objects = without_media<N>(call);
  const Vec3& f = objects.f;
  const double coulomb = objects.coulomb_N, K = objects.K;
  double tolerance = coulomb * (1.0 + 1e-9) + condition(call) * 64.0 * epsilon * K * call.size();
  // On a curved surface, a p̂ that is deep compared with the surface's radius amplifies rounding further. The smallest
  // radius here is 0.01 m.
  tolerance += f.norm() * 64.0 * epsilon * (call.p - call.r).norm() / 0.01;
  // A Coulomb medium's force depends on the proxy's displacement in the medium. The relative rounding of that
  // displacement is large if the displacement is short.
  const double moved = (call.r - call.q).norm();
  if (moved > 0.0) tolerance += coulomb * std::min(16.0 * epsilon * call.size() / moved, 1e-3);
  double unsure = 8.0 * epsilon;  // of the direction of a cone's axis
  const auto friction = [&](const Contact<N>& contact) -> std::optional<double> {
    const auto object = static_cast<std::size_t>(contact.object);
    return N == 1 || object >= scene_.objects.size() ? 0.0 : scene_.objects[object].friction;
  };
  const auto motion = [&](const Contact<N>& contact) -> Vec3 {
    const auto object = static_cast<std::size_t>(contact.object);
    const bool moving_mesh = object < scene_.objects.size() && scene_.objects[object].motion &&
                             std::holds_alternative<scenes::MeshShape>(scene_.objects[object].shape);
    const Vec3 begin = moving_mesh ? call.carried[object] : carried(object, call.time, lift<N>(call.q));
    return lift<N>(call.r) - begin;
  };
  const std::vector<models::ForceCone> cones = models::cones_of_contacts<N>(
      call.contacts, call.size() + carriage(call.time.time_s), friction, motion, [&](double mu, double angle) {
        tolerance += mu * f.norm() * angle * condition(call);
        unsure += mu * angle;
      });
  return models::in_sum_of_cones(f, cones, tolerance + unsure * squeeze(f, cones));
}

double Laws::carriage(double time_s) const {
  double farthest = 0.0;
  for (std::size_t i = 0; i < scripts_.size(); ++i) {
    if (scene_.objects[i].motion) farthest = std::max(farthest, scripts_[i].at(time_s).translation().norm());
  }
  return farthest;
}

Vec3 Laws::carried(std::size_t object, const models::StepTime& time, const Vec3& q) const {
  if (object >= scene_.objects.size() || !scene_.objects[object].motion) return q;
  const models::ScriptedMotion& script = scripts_[object];
  return script.at(time.time_s) * (script.at(time.time_s - time.period_s).inverse(Eigen::Isometry) * q);
}

double Laws::depth(const Vec3& r, double time_s) const {
  double deepest = -infinity;
  for (std::size_t i = 0; i < scene_.objects.size(); ++i) {
    const scenes::Object& object = scene_.objects[i];
    const Vec3 x = object.motion ? Vec3(scripts_[i].at(time_s).inverse(Eigen::Isometry) * r) : r;
    deepest = std::max(deepest, -(convex_[i] ? convex_distance(object, x) : scenes::distance_to(object, x)));
  }
  return deepest;
}

Laws::Curvature Laws::curvature(std::size_t object, double& radius_m) const {
  if (object >= scene_.objects.size()) return Curvature::flat_or_concave;
  const scenes::Shape& shape = scene_.objects[object].shape;
  if (const auto* sphere = std::get_if<scenes::SphereShape>(&shape)) {
    radius_m = sphere->radius_m;
    return sphere->inside_out ? Curvature::flat_or_concave : Curvature::convex;
  }
  if (const auto* capsule = std::get_if<scenes::CapsuleShape>(&shape)) {
    radius_m = capsule->radius_m;
    return capsule->inside_out ? Curvature::flat_or_concave : Curvature::convex;
  }
  if (const auto* box = std::get_if<scenes::BoxShape>(&shape)) {
    return box->inside_out ? Curvature::flat_or_concave : Curvature::edged;
  }
  if (const auto* cylinder = std::get_if<scenes::CylinderShape>(&shape)) {
    return cylinder->inside_out ? Curvature::flat_or_concave : Curvature::edged;
  }
  return std::holds_alternative<scenes::PlaneShape>(shape) ? Curvature::flat_or_concave : Curvature::edged;
}

template Laws::ObjectForce Laws::without_media<1>(const Call<1>&) const;
template Laws::ObjectForce Laws::without_media<2>(const Call<2>&) const;
template Laws::ObjectForce Laws::without_media<3>(const Call<3>&) const;
template bool Laws::obeyed<1>(const Call<1>&) const;
template bool Laws::obeyed<2>(const Call<2>&) const;
template bool Laws::obeyed<3>(const Call<3>&) const;

}  // namespace proxarm::studies
