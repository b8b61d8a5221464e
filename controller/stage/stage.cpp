#include "controller/stage/stage.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "controller/signals/clearances.hpp"
#include "controller/stage/mesh_picture.hpp"
#include "models/base/setup_error.hpp"
#include "scenes/compiler/obstacles.hpp"
#include "scenes/mesh_files/mesh_file.hpp"
#include "scenes/rigid/compile_rigid.hpp"

namespace proxarm::view {
namespace {

using controller::CycleRecord;
using models::Pose;
using models::Vec3;

}  // namespace

Stage::Stage(description::Cell cell, scenes::Scene scene, const StageOptions& options)
    : cell_(std::move(cell)),
      scene_(std::move(scene)),
      options_(options),
      arm_(cell_),
      tree_(cell_),
      compiled_(scenes::compile(scene_)),
      changes_(compiled_, options.period_s) {
  if (scene_.tool && !scenes::why_not(scene_, scene_.tool->shape)) {
    rigid_ = scenes::compile_rigid(scene_, scene_.tool->shape);
  }
}

std::string Stage::mesh_bytes(int link, std::size_t index) const {
  if (link < 0) {
    const auto* const shape =
        index < scene_.objects.size() ? std::get_if<scenes::MeshShape>(&scene_.objects[index].shape) : nullptr;
    if (shape == nullptr || !shape->mesh) throw description::SetupError({.message = "no such mesh"});
    return mesh_picture(shape->mesh->structure().vertices, shape->mesh->structure().triangles, Vec3::Ones());
  }
  const auto& links = tree_.links();
  const auto at = static_cast<std::size_t>(link);
  const auto* const mesh = at < links.size() && index < links[at].shapes.size()
                               ? std::get_if<models::DrawnMesh>(&links[at].shapes[index].shape)
                               : nullptr;
  if (mesh == nullptr) throw description::SetupError({.message = "no such mesh"});
  const models::TriangleSoup soup = scenes::read_mesh_file(mesh->file);
  return mesh_picture(soup.vertices, soup.triangles, mesh->scale);
}

void Stage::follow(const controller::Change& change, bool rendered, double period_s) noexcept {
  changes_.set(change);
  changes_.set_period(period_s);
  if (rendered) changes_.step();
}

void Stage::complete(CycleRecord& record, double rendered_s) const {
  const std::int64_t rendered_ns = std::llround(1e9 * rendered_s);
  if (rigid_) return controller::add_clearances(record, *rigid_, rendered_ns);
  controller::add_clearances(record, scene_, clearances_, rendered_ns);
}

namespace {

// Returns the normal out of the strongest contact's object; zero if there is no contact.
Vec3 strongest_normal(const CycleRecord& record) {
  double most_N = 0.0;
  Vec3 normal = Vec3::Zero();
  for (std::size_t i = 0; i < record.recorded_contacts(); ++i) {
    const double force_N = controller::vec3(record.contacts[i].force_W_N).norm();
    if (force_N <= most_N) continue;
    most_N = force_N;
    normal = controller::vec3(record.contacts[i].normal_W);
  }
  return normal;
}

// Returns the distance along `normal` from which on the tool is deeper in an object than at the beginning; infinite
// beyond Room::most_m.
template <typename Gap>
double way_to_other_side(const Gap& gap_m, const Vec3& normal) {
  // The motion along `normal` may deepen the gaps to other objects that the tool touches a little. Only a deepening of
  // more than tolerance_m counts as blocked.
  constexpr double first_m = 1e-6, tolerance_m = 1e-7;
  constexpr int halvings = 16;
  const double begun_m = std::min(0.0, gap_m(Vec3::Zero()));
  const auto blocked = [&](double t) { return gap_m(t * normal) < begun_m - tolerance_m; };
  double free_m = 0.0, there_m = first_m;
  while (!blocked(there_m)) {
    free_m = there_m;
    there_m *= 2.0;
    if (free_m > Room::most_m) return std::numeric_limits<double>::infinity();
  }
  for (int i = 0; i < halvings; ++i) {
    const double middle = 0.5 * (free_m + there_m);
    (blocked(middle) ? there_m : free_m) = middle;
  }
  return std::max(0.0, there_m - tolerance_m);
}

}  // namespace

std::optional<Room> Stage::room(const CycleRecord& record, double rendered_s) const {
  if (record.phase != controller::Phase::rendering || options_.arm_alone) return std::nullopt;
  const Vec3 proxy = controller::vec3(record.proxy_W_m);
  const models::Quaternion q(record.proxy_q_W.data());
  const auto gap_m = [&](const Vec3& moved) {
    return rigid_ ? rigid_->clearance_at_m({proxy + moved, q}, rendered_s)
                  : clearances_.of_point(proxy + moved, rendered_s, scenes::Driven::left_out);
  };
  Room room{.normal_W = strongest_normal(record), .below_m = 0.0, .above_m = 0.0};
  if (!(room.normal_W.squaredNorm() > 0.5)) {
    room.below_m = gap_m(Vec3::Zero());
    if (!(room.below_m < Room::most_m)) return std::nullopt;
    constexpr double step_m = 1e-7;
    for (int i = 0; i < 3; ++i) {
      const Vec3 step = step_m * Vec3::Unit(i);
      room.normal_W[i] = (gap_m(step) - gap_m(-step)) / (2.0 * step_m);
    }
    if (!(room.normal_W.norm() > 0.1)) return std::nullopt;  // the proxy is equally far from both sides
    room.normal_W.normalize();
  }
  room.above_m = way_to_other_side(gap_m, room.normal_W);
  return room;
}

Pose Stage::tool_pose(std::span<const Pose> links) const noexcept {
  for (std::size_t i = 0; i < links.size() && i < tree_.links().size(); ++i) {
    if (tree_.links()[i].name != cell_.sensor.link) continue;
    return links[i] * models::to_pose(cell_.sensor.pose_link) * models::to_pose(cell_.tool.handle_S);
  }
  return Pose::Identity();
}

models::JointVector Stage::joint_angles(const CycleRecord& record) const {
  models::JointVector motor = arm_.start_rad();
  bool seen = false;
  for (std::size_t i = 0; i < cell_.drives.size() && i < record.actual_counts.size(); ++i) {
    seen = seen || record.actual_counts[i] != 0;
    motor[static_cast<Eigen::Index>(i)] = cell_.drives[i].angle_rad(record.actual_counts[i]);
  }
  return seen ? arm_.link_from_motor(motor) : arm_.start_rad();
}

void Stage::place(const CycleRecord& record, double rendered_s, std::vector<Pose>& links, std::vector<Pose>& objects,
                  std::span<const Vec3> driven_m) const {
  tree_.place(joint_angles(record), links);
  objects.assign(scene_.objects.size(), Pose::Identity());
  for (std::size_t i = 0; i < scene_.objects.size(); ++i) {
    const auto& motion = scene_.objects[i].motion;
    if (!motion) continue;
    if (motion->driven) {
      objects[i].translation() = driven_m.empty() ? this->driven_m(i) : driven_m[i];
    } else {
      objects[i] = scenes::script_of(*motion).at(rendered_s);
    }
  }
}

}  // namespace proxarm::view
