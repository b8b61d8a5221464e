#include "scenes/compiler/clearances.hpp"

#include <algorithm>
#include <limits>

#include "scenes/compiler/obstacles.hpp"

namespace proxarm::scenes {
namespace {

using models::Pose;
using models::Vec3;

bool is_open_mesh(const Object& object) {
  const auto* const shape = std::get_if<MeshShape>(&object.shape);
  return shape != nullptr && !shape->mesh->closed();
}

// Returns the inverse of an object's motion from its described place.
Pose back_to_description(const Object& object, double time_s) {
  const bool moves = object.motion && !object.motion->driven;
  return moves ? script_of(*object.motion).at(time_s).inverse(Eigen::Isometry) : Pose::Identity();
}

// True if an open mesh lies between x and y.
bool separates(const Object& object, const Vec3& x, const Vec3& y) {
  return is_open_mesh(object) && std::get<MeshShape>(object.shape).mesh->first_hit(x, y).any();
}

}  // namespace

Clearances::Clearances(const Scene& scene) : objects_(scene.objects) {
  std::vector<models::BoundsTree::Leaf> leaves;
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const Object& object = scene.objects[i];
    const bool unbounded = std::holds_alternative<PlaneShape>(object.shape) || is_inside_out(object.shape);
    if (object.motion || unbounded || is_open_mesh(object)) {
      others_.push_back(i);
      continue;
    }
    // The box is slightly larger than the object, because of rounding.
    const Vec3 middle = middle_of(object.shape), reach = Vec3::Constant(1.000001 * size_of(object.shape));
    leaves.push_back({{middle - reach, middle + reach}, i});
  }
  if (!leaves.empty()) still_ = models::BoundsTree(std::move(leaves));
}

template <typename Distance>
double Clearances::least(const Vec3& x_W, Driven driven, const Distance& distance) const {
  double least = std::numeric_limits<double>::infinity();
  for (const std::size_t i : others_) {
    const std::optional<Motion>& motion = objects_[i].motion;
    if (motion && motion->driven && driven == Driven::left_out) continue;
    least = std::min(least, distance(objects_[i]));
  }
  return still_.nearest(x_W, least, [&](std::size_t i) { return distance(objects_[i]); });
}

double Clearances::of_point(const Vec3& x_W, double time_s, Driven driven) const {
  return least(x_W, driven,
               [&](const Object& object) { return distance_to(object, back_to_description(object, time_s) * x_W); });
}

double Clearances::of_tool(const Vec3& tool_W, const Vec3& proxy_W, double time_s, Driven driven) const {
  return least(tool_W, driven, [&](const Object& object) {
    const Pose X = back_to_description(object, time_s);
    const Vec3 tool = X * tool_W;
    const double distance = distance_to(object, tool), behind = object.layer ? object.layer->thickness_m : 0.0;
    return separates(object, X * proxy_W, tool) ? 2.0 * behind - distance : distance;
  });
}

std::optional<double> Clearances::of_object(std::size_t object, const Vec3& x_W, double time_s) const {
  const Object& one = objects_[object];
  if (one.motion && one.motion->driven) return std::nullopt;
  return distance_to(one, back_to_description(one, time_s) * x_W);
}

}  // namespace proxarm::scenes
