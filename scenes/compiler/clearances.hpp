// How far a point is from the nearest object of a scene, for summaries, views and tests; not for the cycle.
//
// Objects that stand still are found by a tree of boxes, so that ten thousand of them cost what ten do. The result is
// the one that looking at each of them gives, to the bit.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "models/obstacles/bounds_tree.hpp"
#include "scenes/format/scene.hpp"

namespace proxarm::scenes {

// Driven objects count where they are described, or, if their places aren't known, not at all.
enum class Driven { as_described, left_out };

class Clearances {
 public:
  // Of the scene's objects as they are now.
  explicit Clearances(const Scene& scene);

  // The distance from x_W to the nearest object, in metres: negative inside one, infinite in an empty scene. Elastic
  // layers count as used up. Scripted objects are where they are at time_s; the k-th step of a proxy (counted from 1)
  // is at k T.
  [[nodiscard]] double of_point(const models::Vec3& x_W, double time_s = 0.0,
                                Driven driven = Driven::as_described) const;
  // The same for a tool whose proxy is at proxy_W. An open mesh has no inside; a tool that it separates from its proxy
  // is behind it, and its distance counts as negative.
  [[nodiscard]] double of_tool(const models::Vec3& tool_W, const models::Vec3& proxy_W, double time_s,
                               Driven driven = Driven::as_described) const;
  // The distance to one object; none where it is driven, since its place isn't known. Precondition: object is an index
  // in the scene.
  [[nodiscard]] std::optional<double> of_object(std::size_t object, const models::Vec3& x_W, double time_s) const;

 private:
  template <typename Distance>
  [[nodiscard]] double least(const models::Vec3& x_W, Driven driven, const Distance& distance) const;

  std::vector<Object> objects_;
  models::BoundsTree still_;         // bounded, at rest, and no open mesh
  std::vector<std::size_t> others_;  // indices of all other objects
};

}  // namespace proxarm::scenes
