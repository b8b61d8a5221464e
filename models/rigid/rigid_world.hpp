// 𝒢 of a rigid tool among rigid objects (models/geometry/pose_algorithm.hpp states the law).
//
// 1. Candidates (rigid_pairs/gathering.hpp) are pairs of features, one of the tool and one of an object, whose distance
//    is below a reach that covers several steps to come.
// 2. At a pose q_i each pair has a gap, a normal and a material point (rigid_gaps/gaps.hpp). The pairs that press, and
//    those that the motion would pass, are linearised there and make a local problem (local_step.hpp,
//    contact_problem.hpp). The solution of the local problem is the next pose. This is repeated with new gaps and
//    normals until the pose no longer changes (iteration.hpp).
// 3. A face or an edge holds the tool on the side on which the tool was at q(k−1) (rigid_bodies/sides.hpp). A long step
//    is taken in parts (rigid_step.hpp, step_in_parts.hpp). Each part is so short that no feature gets further behind
//    another one than the recorded sides are valid (Sides::reach_m).
// 4. If the contacts of a solution did work on the tool, the tool has come to a wrong side. The step is then taken in
//    smaller parts. If these have no solution either, the step is unresolved.
// 5. Contact with a moving object is judged in the object's frame (rigid_bodies/rigid_bodies.hpp, step_in_batches.hpp).
//    If the object leaves the tool no room, the tool is squeezed.
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
  // size, points that span no solid, an open mesh as a part of the tool, a friction below 0, a hull of more than 2000
  // points, and a cylinder as a tool with an open mesh or a tube with round ends as an object.
  // An open mesh as an object holds the tool on both sides, but sharp features may pass the mesh's border by
  // micrometres. compile_rigid() refuses open meshes.
  RigidWorld(const Tool& tool, std::vector<RigidObject> objects);

  const ToolPose& step(const Mat6& K, const ToolPose& p_hat, const ToolPose& q) noexcept override;
  void set_time(const StepTime& time) noexcept override;
  [[nodiscard]] bool wants_time() const noexcept override;
  // Sets μ_object. If a part of the tool has a coefficient μ_tool, the friction between this part and the object is
  // √(μ_tool μ_object).
  void set_friction(std::int32_t object, double friction) noexcept override;
  void drive(std::int32_t object, const Pose& X) noexcept override;

  [[nodiscard]] std::span<const PoseContact> contacts() const noexcept override;
  [[nodiscard]] bool unresolved() const noexcept override;
  [[nodiscard]] bool squeezed() const noexcept override;
  // The result is only a lower bound if more features are near than a step has room for. If two corners face each
  // other, so that no feature holds another, the result is larger than their distance. Allocates.
  [[nodiscard]] double clearance_m(const ToolPose& pose) const noexcept override;
  [[nodiscard]] double clearance_at_m(const ToolPose& pose, double time_s) const noexcept override;
  [[nodiscard]] std::unique_ptr<PoseAlgorithm> clone() const override;
  void copy_state(const PoseAlgorithm& other) noexcept override;

  RigidWorld(const RigidWorld&);
  RigidWorld& operator=(const RigidWorld&) noexcept;  // Precondition: both are copies of one world. Doesn't allocate
  ~RigidWorld() override;

 private:
  std::unique_ptr<RigidState> state_;
};

}  // namespace proxarm::models
