// The arm and the scene of a session for display: a description, which is sent once, and the poses of all links and
// objects in a cycle.
//
// Only the cell's and the scene's files are used, so running and recorded sessions look alike. Not for the cycle.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "controller/rendering/scene_changes.hpp"
#include "controller/stage/moment.hpp"
#include "models/arm/arm.hpp"
#include "models/arm/link_tree.hpp"
#include "models/description/cell.hpp"
#include "models/geometry/pose_algorithm.hpp"
#include "scenes/compiler/clearances.hpp"
#include "scenes/compiler/compile.hpp"
#include "scenes/format/scene.hpp"

namespace proxarm::view {

// Settings that the cell's and the scene's files don't contain.
struct StageOptions {
  // Whether the arm is shown without a controller. There is no proxy then, and the phase shows the state of the drives.
  bool arm_alone = false;
  double period_s = 1e-3;
  double mass_kg = 0.0, damping_Ns_per_m = 0.0, spring_N_per_m = 0.0;  // the values with which the session began
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
  // Returns the handle's part of the felt mass; 0 for the impedance type, whose proxy has no mass.
  [[nodiscard]] double handle_mass_kg() const noexcept { return options_.impedance ? 0.0 : cell_.tool.mass_kg; }

  // Returns what a page needs once, as JSON: the wire's fields, links, objects, limits, texts.
  [[nodiscard]] std::string describe() const;
  // Returns a mesh as mesh_picture() packs it: of a link's shape, or of the scene's object if link < 0. Throws
  // SetupError if there is no such mesh.
  [[nodiscard]] std::string mesh_bytes(int link, std::size_t index) const;

  // Changes and moves the objects as the cycle does. `change`: the change that the cycle took. `rendered`: whether the
  // cycle rendered.
  void follow(const controller::Change& change, bool rendered, double period_s) noexcept;

  // Adds the distances of proxy and tool, which the cycle doesn't compute. If the tool has a shape, the shape is used.
  void complete(controller::CycleRecord& record, double rendered_s) const;
  // Returns the room around the proxy. Computes up to some forty distances of the tool; with meshes this takes a
  // millisecond or more.
  [[nodiscard]] std::optional<Room> room(const controller::CycleRecord& record, double rendered_s) const;
  // Returns a driven object's displacement from its pose in the scene's file, after all calls of follow() so far.
  [[nodiscard]] models::Vec3 driven_m(std::size_t object) const noexcept {
    return changes_.position_m(static_cast<std::int32_t>(object));
  }
  // Computes the poses of links and objects. `driven_m`: the displacement of each object; empty: the displacements
  // after the last follow().
  void place(const controller::CycleRecord& record, double rendered_s, std::vector<models::Pose>& links,
             std::vector<models::Pose>& objects, std::span<const models::Vec3> driven_m = {}) const;
  // Returns X_WT, from the links' poses that place() has computed.
  [[nodiscard]] models::Pose tool_pose(std::span<const models::Pose> links) const noexcept;
  // Returns the links' angles by the encoders; before the first feedback, the angles at the start.
  [[nodiscard]] models::JointVector joint_angles(const controller::CycleRecord& record) const;

 private:
  description::Cell cell_;
  scenes::Scene scene_;
  scenes::Clearances clearances_{scene_};
  StageOptions options_;
  models::Arm arm_;
  models::LinkTree tree_;
  scenes::CompiledScene compiled_;  // needed only by changes_, which refers to it
  controller::SceneChanges changes_;
  std::unique_ptr<models::PoseAlgorithm> rigid_;  // computes distances of a tool with a shape; null: a point tool
};

}  // namespace proxarm::view
