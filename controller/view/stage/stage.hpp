// The arm and the scene of a session for display: a description that is sent once, and the poses of all links and
// objects in a cycle.
//
// It uses only the cell's and the scene's files, so running and recorded sessions look alike. Not for the cycle.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "controller/rendering/scene_changes.hpp"
#include "controller/view/stage/moment.hpp"
#include "models/arm/arm.hpp"
#include "models/arm/link_tree.hpp"
#include "models/description/cell.hpp"
#include "models/geometry/pose_algorithm.hpp"
#include "scenes/compiler/clearances.hpp"
#include "scenes/compiler/compile.hpp"
#include "scenes/format/scene.hpp"

namespace proxarm::view {

// Settings that the files don't contain.
struct StageOptions {
  bool arm_alone = false;  // without a controller: no proxy, and the phase stands for the state of the drives
  double period_s = 1e-3;
  double mass_kg = 0.0, damping_Ns_per_m = 0.0, spring_N_per_m = 0.0;  // those with which the session began
  bool impedance = false;
};

class Stage {
 public:
  // Throws SetupError.
  Stage(description::Cell cell, scenes::Scene scene, const StageOptions& options);

  [[nodiscard]] const description::Cell& cell() const noexcept { return cell_; }
  [[nodiscard]] const scenes::Scene& scene() const noexcept { return scene_; }
  [[nodiscard]] const StageOptions& options() const noexcept { return options_; }
  [[nodiscard]] const models::LinkTree& links() const noexcept { return tree_; }
  // The handle's part of the felt mass; 0 in the impedance type, whose proxy has no mass.
  [[nodiscard]] double handle_mass_kg() const noexcept { return options_.impedance ? 0.0 : cell_.tool.mass_kg; }

  // Everything that a page needs once, as JSON: fields of the wire, links, objects, limits, texts.
  [[nodiscard]] std::string describe() const;
  // A mesh of the scene (link < 0) or of a link's shape, as mesh_picture() packs it. Throws SetupError.
  [[nodiscard]] std::string mesh_bytes(int link, std::size_t index) const;

  // Moves and changes the objects as the cycle does. `change`: taken by the cycle; `rendered`: whether it rendered.
  void follow(const controller::Change& change, bool rendered, double period_s) noexcept;

  // Adds the distances of proxy and tool, using the tool's shape if it has one: the cycle doesn't compute them.
  void complete(controller::CycleRecord& record, double rendered_s) const;
  // The room around the proxy, by up to some forty distances of the tool; with meshes a millisecond or more.
  [[nodiscard]] std::optional<Room> room(const controller::CycleRecord& record, double rendered_s) const;
  // A driven object's displacement from its pose in the scene's file, after all calls of follow().
  [[nodiscard]] models::Vec3 driven_m(std::size_t object) const noexcept {
    return changes_.position_m(static_cast<std::int32_t>(object));
  }
  // The poses of links and objects. `driven_m`: the displacement of each object, if it isn't that of the last follow().
  void place(const controller::CycleRecord& record, double rendered_s, std::vector<models::Pose>& links,
             std::vector<models::Pose>& objects, std::span<const models::Vec3> driven_m = {}) const;
  // X_WT, from the links that place() has computed.
  [[nodiscard]] models::Pose tool_pose(std::span<const models::Pose> links) const noexcept;
  // The links' angles by the encoders; those of the start before the first feedback.
  [[nodiscard]] models::JointVector joint_angles(const controller::CycleRecord& record) const;

 private:
  description::Cell cell_;
  scenes::Scene scene_;
  scenes::Clearances clearances_{scene_};
  StageOptions options_;
  models::Arm arm_;
  models::LinkTree tree_;
  scenes::CompiledScene compiled_;  // only for the changes to its objects
  controller::SceneChanges changes_;
  std::unique_ptr<models::PoseAlgorithm> rigid_;  // for distances of a tool with a shape; null: a point tool
};

}  // namespace proxarm::view
