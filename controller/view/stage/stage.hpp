// The arm and the scene of a session: what stands there, told once, and where it all is in a cycle.
//
// Made from the cell's and the scene's files alone, so a session that runs and one that was recorded look alike. For
// pictures, outside of the cycle.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "controller/rendering/scene_changes.hpp"
#include "controller/view/stage/moment.hpp"
#include "models/arm/arm.hpp"
#include "models/arm/link_tree.hpp"
#include "models/description/cell.hpp"
#include "scenes/compiler/compile.hpp"
#include "scenes/format/scene.hpp"

namespace proxarm::view {

// What isn't in the files.
struct StageOptions {
  bool arm_alone = false;  // without a controller: no proxy, and what is called a phase is how far its drives are
  double period_s = 1e-3;
  double mass_kg = 0.0, damping_Ns_per_m = 0.0, spring_N_per_m = 0.0;  // as the session began
  bool impedance = false;
  int order = 1;
};

class Stage {
 public:
  // Throws SetupError.
  Stage(description::Cell cell, scenes::Scene scene, const StageOptions& options);

  [[nodiscard]] const description::Cell& cell() const noexcept { return cell_; }
  [[nodiscard]] const scenes::Scene& scene() const noexcept { return scene_; }
  [[nodiscard]] const StageOptions& options() const noexcept { return options_; }
  [[nodiscard]] const models::LinkTree& links() const noexcept { return tree_; }
  // Of what the hand feels; 0 in the impedance type, which has no proxy with a mass.
  [[nodiscard]] double handle_mass_kg() const noexcept { return options_.impedance ? 0.0 : cell_.tool.mass_kg; }

  // All that a page must know once, as JSON: fields of the wire, links, objects, limits, words.
  [[nodiscard]] std::string describe() const;
  // A mesh of the scene (link < 0) or of a link's shape, as mesh_picture() packs it. Throws SetupError.
  [[nodiscard]] std::string mesh_bytes(int link, std::size_t index) const;

  // The same objects move and change as in the cycle: `change` is what it took, `rendered` whether it rendered.
  void follow(const controller::Change& change, bool rendered, double period_s) noexcept;

  // Distances that only the scene knows, which the cycle leaves out.
  void complete(controller::CycleRecord& record, double rendered_s) const;
  // How far an object that is driven is from where the scene describes it, after all that follow() was told.
  [[nodiscard]] models::Vec3 driven_m(std::size_t object) const noexcept {
    return changes_.position_m(static_cast<std::int32_t>(object));
  }
  // Where links and objects are. `driven_m`: of each object, where it isn't that of the last follow().
  void place(const controller::CycleRecord& record, double rendered_s, std::vector<models::Pose>& links,
             std::vector<models::Pose>& objects, std::span<const models::Vec3> driven_m = {}) const;
  // X_WT, of links that place() has placed.
  [[nodiscard]] models::Pose tool_pose(std::span<const models::Pose> links) const noexcept;
  // Angles of the links by the encoders; those of the start before the first feedback.
  [[nodiscard]] models::JointVector joint_angles(const controller::CycleRecord& record) const;

 private:
  description::Cell cell_;
  scenes::Scene scene_;
  StageOptions options_;
  models::Arm arm_;
  models::LinkTree tree_;
  scenes::CompiledScene compiled_;  // for the changes to its objects alone
  controller::SceneChanges changes_;
};

}  // namespace proxarm::view
