#include "controller/view/stage/stage.hpp"

#include <algorithm>
#include <cmath>

#include "controller/signals/clearances.hpp"
#include "controller/view/stage/mesh_picture.hpp"
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
