#include "scenes/compiler/obstacles.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "models/base/setup_error.hpp"
#include "models/mesh/mesh_obstacle.hpp"
#include "models/obstacles/box_obstacle.hpp"
#include "models/obstacles/cylinder_obstacle.hpp"
#include "models/obstacles/plane_obstacle.hpp"
#include "models/obstacles/round_obstacle.hpp"

namespace proxarm::scenes {
namespace {

using models::Layer;
using models::Vec3;

Vec3 direction(const CylinderShape& c) { return (c.to_m - c.from_m).normalized(); }

std::vector<Part> one(std::unique_ptr<models::Obstacle> obstacle) {
  std::vector<Part> parts;
  parts.push_back({std::move(obstacle), -1});
  return parts;
}

struct MakeParts {
  double mu;
  Layer layer;
  std::vector<double> mu_of_face{};  // friction of each face of a mesh

  std::vector<Part> operator()(const PlaneShape& s) const {
    return one(std::make_unique<models::PlaneObstacle>(s.point_m, s.normal, mu, layer));
  }
  std::vector<Part> operator()(const SphereShape& s) const {
    return one(std::make_unique<models::Sphere>(models::PointCore{s.centre_m}, s.radius_m, mu, s.inside_out, layer));
  }
  std::vector<Part> operator()(const CapsuleShape& s) const {
    return one(
        std::make_unique<models::Capsule>(models::SegmentCore(s.from_m, s.to_m), s.radius_m, mu, s.inside_out, layer));
  }
  std::vector<Part> operator()(const BoxShape& s) const {
    if (!s.inside_out) return one(std::make_unique<models::BoxObstacle>(s.pose_W, s.size_m, mu, layer));
    std::vector<Part> parts;
    for (const auto& face : models::BoxObstacle::faces(s.pose_W, s.size_m)) {
      parts.push_back({std::make_unique<models::PlaneObstacle>(face.point(), Vec3(-face.normal()), mu, layer),
                       static_cast<std::int32_t>(parts.size())});
    }
    return parts;
  }
  std::vector<Part> operator()(const CylinderShape& s) const {
    if (!s.inside_out) return one(std::make_unique<models::CylinderObstacle>(s.from_m, s.to_m, s.radius_m, mu, layer));
    std::vector<Part> parts;
    const Vec3 e = direction(s);
    parts.push_back(
        {std::make_unique<models::RoundBar>(models::LineCore{s.from_m, e}, s.radius_m, mu, true, layer), 0});
    parts.push_back({std::make_unique<models::PlaneObstacle>(s.to_m, Vec3(-e), mu, layer), 1});
    parts.push_back({std::make_unique<models::PlaneObstacle>(s.from_m, e, mu, layer), 2});
    return parts;
  }
  std::vector<Part> operator()(const MeshShape& s) const {
    return one(std::make_unique<models::MeshObstacle>(s.mesh, mu, mu_of_face));
  }
};

double segment_distance(const Vec3& a, const Vec3& b, const Vec3& x) {
  return (x - models::SegmentCore(a, b).nearest(x)).norm();
}

struct Distance {
  Vec3 x;

  double operator()(const PlaneShape& s) const { return s.normal.normalized().dot(x - s.point_m); }
  double operator()(const SphereShape& s) const { return side(s.inside_out, (x - s.centre_m).norm() - s.radius_m); }
  double operator()(const CapsuleShape& s) const {
    return side(s.inside_out, segment_distance(s.from_m, s.to_m, x) - s.radius_m);
  }
  double operator()(const BoxShape& s) const {
    const Vec3 d = (s.pose_W.inverse() * x).cwiseAbs() - 0.5 * s.size_m;
    return side(s.inside_out, d.cwiseMax(0.0).norm() + std::min(0.0, d.maxCoeff()));
  }
  double operator()(const CylinderShape& s) const {
    const Vec3 e = direction(s), d = x - 0.5 * (s.from_m + s.to_m);
    const double z = std::abs(e.dot(d)) - 0.5 * (s.to_m - s.from_m).norm();
    const double across = (d - e * e.dot(d)).norm() - s.radius_m;
    return side(s.inside_out, std::hypot(std::max(z, 0.0), std::max(across, 0.0)) + std::min(0.0, std::max(z, across)));
  }
  // An open mesh has no inside, so its distance is never negative.
  double operator()(const MeshShape& s) const {
    std::uint32_t near = 0;
    const double distance = s.mesh->distance(x, std::numeric_limits<double>::infinity(), near);
    if (!s.mesh->closed()) return distance;
    return side(s.inside_out, s.mesh->encloses(x) ? -distance : distance);
  }

 private:
  static double side(bool inside_out, double distance) { return inside_out ? -distance : distance; }
};

struct Middle {
  Vec3 operator()(const PlaneShape& s) const { return s.point_m; }
  Vec3 operator()(const BoxShape& s) const { return s.pose_W.translation(); }
  Vec3 operator()(const SphereShape& s) const { return s.centre_m; }
  Vec3 operator()(const CapsuleShape& s) const { return 0.5 * (s.from_m + s.to_m); }
  Vec3 operator()(const CylinderShape& s) const { return 0.5 * (s.from_m + s.to_m); }
  Vec3 operator()(const MeshShape& s) const { return 0.5 * (s.mesh->bounds().low + s.mesh->bounds().high); }
};
struct Size {
  double operator()(const PlaneShape&) const { return 0.5; }
  double operator()(const BoxShape& s) const { return 0.5 * s.size_m.norm(); }
  double operator()(const SphereShape& s) const { return s.radius_m; }
  double operator()(const CapsuleShape& s) const { return 0.5 * (s.to_m - s.from_m).norm() + s.radius_m; }
  double operator()(const CylinderShape& s) const { return 0.5 * (s.to_m - s.from_m).norm() + s.radius_m; }
  double operator()(const MeshShape& s) const { return 0.5 * (s.mesh->bounds().high - s.mesh->bounds().low).norm(); }
};

// Returns the cavity that remains when the layer of an inside-out object is fully compressed: the walls recede by the
// layer's thickness.
struct StandBack {
  double by_m;

  Shape operator()(PlaneShape s) const { return s; }
  Shape operator()(SphereShape s) const {
    s.radius_m += by_m;
    return s;
  }
  Shape operator()(CapsuleShape s) const {
    s.radius_m += by_m;
    return s;
  }
  Shape operator()(BoxShape s) const {
    s.size_m.array() += 2.0 * by_m;
    return s;
  }
  Shape operator()(CylinderShape s) const {
    const Vec3 e = direction(s);
    s.radius_m += by_m;
    s.from_m -= by_m * e;
    s.to_m += by_m * e;
    return s;
  }
  Shape operator()(MeshShape s) const { return s; }
};

// Returns the thickness of the solid under a layer; 0 if the shape can't have a layer.
struct Thickness {
  static constexpr double kEndless = std::numeric_limits<double>::infinity();

  double operator()(const PlaneShape&) const { return kEndless; }
  double operator()(const SphereShape& s) const { return s.inside_out ? kEndless : 2.0 * s.radius_m; }
  double operator()(const CapsuleShape& s) const { return s.inside_out ? kEndless : 2.0 * s.radius_m; }
  double operator()(const BoxShape& s) const { return s.inside_out ? kEndless : s.size_m.minCoeff(); }
  double operator()(const CylinderShape& s) const {
    return s.inside_out ? kEndless : std::min(2.0 * s.radius_m, (s.to_m - s.from_m).norm());
  }
  double operator()(const MeshShape&) const { return 0.0; }
};

}  // namespace

Vec3 middle_of(const Shape& shape) { return std::visit(Middle{}, shape); }
double size_of(const Shape& shape) { return std::visit(Size{}, shape); }

description::SetupError refusal(const Scene& scene, int line, std::string message, std::string advice) {
  return description::SetupError(
      {.file = scene.file.string(), .line = line, .message = std::move(message), .advice = std::move(advice)});
}

Layer layer_on(const Scene& scene, const Object& object, double thickness_m, const std::string& expected) {
  if (!object.layer) return {};
  if (!(object.layer->thickness_m < 0.5 * thickness_m)) {
    throw description::SetupError(
        {.file = scene.file.string(),
         .line = object.line,
         .key = "layer",
         .found = "a layer of " + description::number_text(object.layer->thickness_m) + " m on " + object.name,
         .expected = expected});
  }
  return {object.layer->stiffness_N_per_m, object.layer->thickness_m};
}

std::vector<Part> parts_of(const Scene& scene, const Object& object) {
  // A mesh can't have a layer: the faces of a mesh are exact on both sides, and a layer would make them inexact.
  const double thickness = std::visit(Thickness{}, object.shape);
  const Layer layer =
      layer_on(scene, object, thickness,
               thickness > 0.0 ? "less than half of how thick the object is" : "a layer on an object that is no mesh");
  return std::visit(MakeParts{object.friction, layer, friction_by_face(scene, object)}, object.shape);
}

std::vector<double> friction_by_face(const Scene& scene, const Object& object) {
  const auto* shape = std::get_if<MeshShape>(&object.shape);
  if (shape == nullptr || object.friction_regions.empty()) return {};
  const models::TriangleMesh& mesh = *shape->mesh;
  std::vector<double> friction(mesh.size(), object.friction);
  for (const FrictionRegion& region : object.friction_regions) {
    const auto within = region_of(region.within);
    bool any = false;
    for (std::uint32_t face = 0; face < mesh.size(); ++face) {
      const Vec3 middle = (mesh.corner(face, 0) + mesh.corner(face, 1) + mesh.corner(face, 2)) / 3.0;
      if (within->distance(middle) > 0.0) continue;
      friction[face] = region.friction;
      any = true;
    }
    if (any) continue;
    throw description::SetupError({.file = scene.file.string(),
                                   .line = region.line,
                                   .key = "friction_regions",
                                   .found = "a region of " + object.name + " that holds the middle of no triangle",
                                   .expected = "a shape, in W, that reaches the mesh"});
  }
  return friction;
}

std::unique_ptr<models::Obstacle> region_of(const Shape& shape) {
  Shape solid = shape;
  std::visit(
      [](auto& s) {
        if constexpr (requires { s.inside_out; }) s.inside_out = false;
      },
      solid);
  return std::move(std::visit(MakeParts{0.0, {}, {}}, solid).front().obstacle);
}

models::ScriptedMotion script_of(const Motion& motion) {
  return {.velocity_m_per_s = motion.velocity_m_per_s,
          .amplitude_m = motion.amplitude_m,
          .frequency_Hz = motion.frequency_Hz,
          .phase_rad = motion.phase_rad,
          .axis = motion.axis.normalized(),
          .centre_m = motion.centre_m,
          .turn_rad_per_s = motion.turn_rad_per_s};
}

bool is_inside_out(const Shape& shape) {
  return std::visit(
      [](const auto& s) {
        if constexpr (requires { s.inside_out; }) return s.inside_out;
        return false;
      },
      shape);
}

double distance_to(const Object& object, const Vec3& x_W) {
  if (!object.layer) return std::visit(Distance{x_W}, object.shape);
  const double thickness = object.layer->thickness_m;
  if (is_inside_out(object.shape)) return std::visit(Distance{x_W}, std::visit(StandBack{thickness}, object.shape));
  return std::visit(Distance{x_W}, object.shape) + thickness;
}

}  // namespace proxarm::scenes
