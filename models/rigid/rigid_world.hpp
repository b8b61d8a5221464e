// 𝒢 of a rigid tool among rigid objects (models/geometry/pose_algorithm.hpp states the law).
//
// 1. Candidates (rigid_pairs/gathering.hpp): pairs of features, one of the tool and one of an object, that come within
// a
//    distance of each other that the steps to come won't exceed.
// 2. At a pose q_i each pair has a gap, a normal and a material point (rigid_gaps/gaps.hpp). Linearised there, pairs
//    that press or would be passed make a local problem (local_step.hpp, contact_problem.hpp); its solution is the next
//    pose. Gaps and normals are taken again until nothing moves (iteration.hpp).
// 3. The side of a face or an edge that holds the tool is the side on which the tool was at q(k−1)
//    (rigid_bodies/sides.hpp). A long step is taken in parts (rigid_step.hpp, step_in_parts.hpp), each so short that no
//    feature gets past the reach of the sides. A solution in which the contacts did work on the tool is on a side to
//    which it didn't come: then the parts are made smaller, and if they lead nowhere the step is unresolved.
// 4. An object that moves is touched in its own frame (rigid_bodies/rigid_bodies.hpp, step_in_batches.hpp). If it
// leaves
//    the tool no room, the tool is squeezed.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "models/geometry/pose_algorithm.hpp"
#include "models/rigid_features/rigid_object.hpp"
#include "models/rigid_shapes/tool.hpp"

namespace proxarm::models {

struct RigidState;

class RigidWorld final : public PoseAlgorithm {
 public:
  // Throws std::invalid_argument for a tool without parts (a point is rendered by a World), a tool's shape without a
  // size, points that span no solid, an open mesh as a part of the tool, a friction below 0, a hull of more than
  // 2000 points, and a cylinder as a tool beside an open mesh or a tube with round ends. An open mesh as an object,
  // which compile_rigid() refuses, is held from both sides, but sharp features may pass its border by micrometres.
  RigidWorld(const Tool& tool, std::vector<RigidObject> objects);

  const ToolPose& step(const Mat6& K, const ToolPose& p_hat, const ToolPose& q) noexcept override;
  void set_time(const StepTime& time) noexcept override;
  [[nodiscard]] bool wants_time() const noexcept override;
  // Between the object and a part of the tool with a friction of its own, √(μ_tool μ_object) holds.
  void set_friction(std::int32_t object, double friction) noexcept override;
  void drive(std::int32_t object, const Pose& X) noexcept override;

  [[nodiscard]] std::span<const PoseContact> contacts() const noexcept override;
  [[nodiscard]] bool unresolved() const noexcept override;
  [[nodiscard]] bool squeezed() const noexcept override;
  // A lower bound if more is near than a step has room for. Between corners that face each other, where no feature
  // holds another one, more than their distance. Allocates.
  [[nodiscard]] double clearance_m(const ToolPose& pose) const noexcept override;
  [[nodiscard]] double clearance_at_m(const ToolPose& pose, double time_s) const noexcept override;
  [[nodiscard]] std::unique_ptr<PoseAlgorithm> clone() const override;
  void copy_state(const PoseAlgorithm& other) noexcept override;

  RigidWorld(const RigidWorld&);
  RigidWorld& operator=(const RigidWorld&) noexcept;  // Precondition: of the same world. Doesn't allocate
  ~RigidWorld() override;

 private:
  std::unique_ptr<RigidState> state_;
};

}  // namespace proxarm::models
