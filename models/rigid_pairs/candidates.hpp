// Keeps the pairs of features that may meet in the steps to come, with what is known about the pairs.
#pragma once

#include <array>
#include <span>

#include "models/local_problem/contact_problem.hpp"
#include "models/rigid_bodies/rigid_bodies.hpp"
#include "models/rigid_features/near_lists.hpp"

namespace proxarm::models {

// Places that pressed in the last local problem. They refer to pairs by index, so they are dropped when pairs are
// gathered anew.
struct PressedPlaces {
  struct Place {
    std::uint16_t pair = 0;
    std::uint8_t which = 0;  // which place of a pair that touches at several places
    Vec3 force_W = Vec3::Zero();
    Vec3 point_W = Vec3::Zero();  // position of the tool's material point after that solution
  };
  std::array<Place, ContactProblem::most> places;
  std::size_t count = 0;

  // Returns null if the place didn't press.
  [[nodiscard]] const Place* of(std::uint16_t pair, std::uint8_t which) const noexcept;
};

struct Candidates {
  static constexpr std::size_t most_pairs = 768;

  explicit Candidates(const RigidSetup& setup);

  [[nodiscard]] std::span<Pair> all() noexcept { return std::span(pairs).first(count); }
  [[nodiscard]] std::span<const Pair> all() const noexcept { return std::span(pairs).first(count); }
  // Returns the index of the first pair to look at. If a carrier exists, no object that stands still is near, so the
  // pairs with such objects are skipped.
  [[nodiscard]] std::size_t first(const RigidBodies& bodies) const noexcept {
    return bodies.has_carrier() ? still_count : 0;
  }
  // Returns how far the tool has moved since the pairs were gathered, relative to the objects that it may meet, m.
  [[nodiscard]] double came_m(const RigidBodies& bodies, const ToolPose& q) const noexcept;
  // Whether near_leaves covers the surroundings of a pose up to `reach` (m), and whether near_triangles covers a pose.
  [[nodiscard]] bool lists_leaves(const RigidBodies& bodies, const ToolPose& pose, double reach) const noexcept;
  [[nodiscard]] bool lists_triangles(const RigidBodies& bodies, const ToolPose& pose) const noexcept;
  // Drops all pairs and lists: the tool was put to another place.
  void forget() noexcept;

  std::array<Pair, most_pairs> pairs;
  std::size_t count = 0;
  std::size_t still_count = 0;  // number of pairs with objects that can't move; these pairs come first
  ToolPose gathered_at;
  double gathered_reach_m = -1.0;
  bool crowded = false;            // true if there was no room for all pairs
  std::size_t triangles_near = 0;  // number of triangles that the last gathering looked at
  PressedPlaces pressed;
  NearLeaves near_leaves;        // leaves of two meshes; only for objects that can't move
  double list_further = 2.0;     // the reach of the list of leaves divided by the reach of the pairs
  NearTriangles near_triangles;  // triangles of a mesh near a solid, from the last gathering
};

}  // namespace proxarm::models
