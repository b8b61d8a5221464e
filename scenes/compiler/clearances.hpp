// Computes the distance of a point to the nearest object of a scene, for summaries, views and tests; not for the cycle.
//
// Objects at rest are in a tree of boxes, so a query among ten thousand objects is about as fast as among ten. The
// result equals that of a search over all objects, to the bit.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "models/obstacles/bounds_tree.hpp"
#include "scenes/format/scene.hpp"

namespace proxarm::scenes {

// Whether driven objects count (in their described places) or are left out.
enum class Driven { as_described, left_out };

class Clearances {
 public:
  // Copies the scene's objects.
  explicit Clearances(const Scene& scene);

  // Returns the distance in metres from x_W to the nearest object: negative inside an object, infinite in an empty
  // scene. Elastic layers count as fully compressed. Scripted objects are at their places at time_s; the k-th step of a
  // proxy (counted from 1) is at time k T.
  [[nodiscard]] double of_point(const models::Vec3& x_W, double time_s = 0.0,
                                Driven driven = Driven::as_described) const;
  // Returns the distance of a tool at tool_W whose proxy is at proxy_W. An open mesh has no inside; if an open mesh
  // separates the tool from its proxy, the distance is negative.
  [[nodiscard]] double of_tool(const models::Vec3& tool_W, const models::Vec3& proxy_W, double time_s,
                               Driven driven = Driven::as_described) const;
  // Returns the distance to one object; nullopt if the object is driven, because its place is unknown. Precondition:
  // `object` is an index in the scene.
  [[nodiscard]] std::optional<double> of_object(std::size_t object, const models::Vec3& x_W, double time_s) const;

 private:
  template <typename Distance>
  [[nodiscard]] double least(const models::Vec3& x_W, Driven driven, const Distance& distance) const;

  std::vector<Object> objects_;
  models::BoundsTree still_;         // bounded objects at rest, except open meshes
  std::vector<std::size_t> others_;  // indices of all other objects
};

}  // namespace proxarm::scenes
