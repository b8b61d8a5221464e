// The pairs of features that may meet in the steps to come, with what was found out about them.
#pragma once

#include <array>
#include <span>

#include "models/local_problem/contact_problem.hpp"
#include "models/rigid_bodies/rigid_bodies.hpp"
#include "models/rigid_features/near_lists.hpp"

namespace proxarm::models {

// Places that pressed in the last local problem. They refer to pairs by index, so they end when pairs are gathered.
struct PressedPlaces {
  struct Place {
    std::uint16_t pair = 0;
    std::uint8_t which = 0;  // of a pair that touches at several places
    Vec3 force_W = Vec3::Zero();
    Vec3 point_W = Vec3::Zero();  // of the tool's material, where that solution moves it
  };
  std::array<Place, ContactProblem::most> places;
  std::size_t count = 0;

  // Null if it didn't press.
  [[nodiscard]] const Place* of(std::uint16_t pair, std::uint8_t which) const noexcept;
};

struct Candidates {
  static constexpr std::size_t most_pairs = 768;

  explicit Candidates(const RigidSetup& setup);

  [[nodiscard]] std::span<Pair> all() noexcept { return std::span(pairs).first(count); }
  [[nodiscard]] std::span<const Pair> all() const noexcept { return std::span(pairs).first(count); }
  // Index of the first pair to look at: those with objects that stand still are left out if nothing of them is near.
  [[nodiscard]] std::size_t first(const RigidBodies& bodies) const noexcept {
    return bodies.has_carrier() ? still_count : 0;
  }
  // How far the tool has come since the pairs were gathered, relative to what it may meet, m.
  [[nodiscard]] double came_m(const RigidBodies& bodies, const ToolPose& q) const noexcept;
  // Whether the list of leaves, or of triangles, covers a pose and its surroundings.
  [[nodiscard]] bool lists_leaves(const RigidBodies& bodies, const ToolPose& pose, double reach) const noexcept;
  [[nodiscard]] bool lists_triangles(const RigidBodies& bodies, const ToolPose& pose) const noexcept;
  // The tool begins anew elsewhere.
  void forget() noexcept;

  std::array<Pair, most_pairs> pairs;
  std::size_t count = 0;
  std::size_t still_count = 0;  // the first pairs are with objects that stand still, the others with objects that move
  ToolPose gathered_at;
  double gathered_reach_m = -1.0;
  bool crowded = false;            // there was no room for all pairs
  std::size_t triangles_near = 0;  // how many were looked at
  PressedPlaces pressed;
  NearLeaves near_leaves;        // of two meshes, for objects that stand still
  double list_further = 2.0;     // leaves are listed this many times as far around as pairs are gathered
  NearTriangles near_triangles;  // of a mesh and a solid, at the last gathering
};

}  // namespace proxarm::models
