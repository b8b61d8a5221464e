// What the proxy's space has of a scene, sorted by what it takes to render it. In three dimensions that is all of it;
// in fewer, sections (section.hpp).
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "scenes/compiler/obstacles.hpp"

namespace proxarm::scenes {

// A plane of W cut by the proxy's space: a half-space of fewer dimensions.
template <int N>
struct HalfSpace {
  std::int32_t object = 0;   // its index in the scene
  std::int32_t feature = 0;  // of the object
  models::Vec<N> point = models::Vec<N>::Zero();
  models::Vec<N> normal = models::Vec<N>::Zero();
};

// A sphere cut by the space: one of fewer dimensions.
struct Ball {
  std::int32_t object = 0;
  models::Vec3 centre = models::Vec3::Zero();  // in coordinates of the space, then zeros
  double radius_m = 0.0;
  bool inside_out = false;
};

// Any other object, at rest, in coordinates of the space.
struct Solid {
  std::int32_t object = 0;
  std::vector<Part> parts;  // none if the space doesn't meet it
};

template <int N>
struct Cut {
  std::vector<HalfSpace<N>> planes;  // flat, rigid and still, faces of boxes from inside among them
  std::vector<Ball> balls;           // rigid and still spheres, with N < 3 only
  std::vector<Solid> solids;
  std::vector<std::int32_t> missed;                           // objects that the space doesn't meet
  std::vector<std::pair<std::int32_t, std::int32_t>> joined;  // pairs of objects that hold as one (seams.hpp)
};

// The mesh that is all there is, still and without a layer; nullptr for any other scene. In three dimensions it needs
// no obstacle around it, and no solid is made of it.
const MeshShape* lone_mesh(const Scene& scene);

// Throws SetupError for what can't be cut; see section.hpp.
template <int N>
Cut<N> cut_by_space(const Scene& scene);
extern template Cut<1> cut_by_space<1>(const Scene&);
extern template Cut<2> cut_by_space<2>(const Scene&);
extern template Cut<3> cut_by_space<3>(const Scene&);

}  // namespace proxarm::scenes
