// Gathers the pairs of features, one of the tool and one of an object, whose distance is below a reach. The reach
// covers several steps to come, so pairs needn't be gathered in each step.
#pragma once

#include "models/rigid_features/near_faces.hpp"
#include "models/rigid_pairs/candidates.hpp"

namespace proxarm::models {

class Gathering {
 public:
  Gathering(RigidBodies& bodies, Candidates& out) noexcept : bodies_(&bodies), out_(&out) {}

  // Gathers pairs around q with a reach that suffices for several steps in which no point moves by more than `far_m`.
  // The reach is smaller if there is no room for all pairs.
  void gather_for(const ToolPose& q, double far_m) noexcept;
  // Gathers all pairs of features within `reach_m` of each other, with the tool at a pose.
  void gather(const ToolPose& pose, double reach_m) noexcept;

 private:
  struct KeptPairs {
    std::array<Pair, ContactProblem::most> pairs;
    std::size_t count = 0;
  };

  // Whether the ball around a part of the tool, enlarged by `reach`, meets the box around an object.
  [[nodiscard]] static bool may_reach(const RigidPart& part, const RigidEntry& entry, const View& at,
                                      double reach) noexcept;
  bool look_around(const ToolPose& pose, double reach, std::size_t pairs = Candidates::most_pairs,
                   std::size_t faces = NearFaces::most_faces) noexcept;
  [[nodiscard]] KeptPairs pressed_pairs() const noexcept;
  void restore(const KeptPairs& kept) noexcept;
  void list_leaves(const ToolPose& pose, double reach) noexcept;
  void list_leaves_within(const ToolPose& pose, double reach) noexcept;
  void gather_entry(std::uint16_t entry, const ToolPose& pose, double reach) noexcept;
  void gather_part(std::uint16_t part, std::uint16_t entry, const View& at, double reach) noexcept;
  void gather_cylinder(std::uint16_t part, std::uint16_t entry, const View& at, double reach) noexcept;
  void gather_cylinders(std::uint16_t part, std::uint16_t entry, const View& at, double reach) noexcept;
  void gather_meshes(std::uint16_t part, std::uint16_t entry, const View& at, double reach) noexcept;
  void gather_flat_or_hollow(std::uint16_t part, std::uint16_t entry, const View& at, double reach) noexcept;
  void add(PairKind kind, std::uint16_t part, std::uint16_t entry, std::uint32_t own, std::uint32_t other,
           double apart_m) noexcept;
  bool list_triangles(std::uint16_t part, std::uint16_t entry, const NearFaces& close) noexcept;
  // Counts one more triangle. Returns false if there is no room for it.
  bool take_face(std::size_t& looked_at) noexcept;

  RigidBodies* bodies_;
  Candidates* out_;
  std::size_t pair_room_ = Candidates::most_pairs, face_room_ = NearFaces::most_faces;
};

}  // namespace proxarm::models
