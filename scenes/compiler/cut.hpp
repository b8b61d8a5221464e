// The part of a scene within the proxy's space, sorted by how it is rendered. In three dimensions that is the whole
// scene; in fewer, sections (section.hpp).
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "scenes/compiler/obstacles.hpp"

namespace proxarm::scenes {

// A plane of W, cut by the proxy's space: a half-space of fewer dimensions.
template <int N>
struct HalfSpace {
  std::int32_t object = 0;   // index in the scene
  std::int32_t feature = 0;  // of the object
  models::Vec<N> point = models::Vec<N>::Zero();
  models::Vec<N> normal = models::Vec<N>::Zero();
};

// A sphere, cut by the space: a sphere of fewer dimensions.
struct Ball {
  std::int32_t object = 0;
  models::Vec3 centre = models::Vec3::Zero();  // in coordinates of the space, padded with zeros
  double radius_m = 0.0;
  bool inside_out = false;
};

// Any other object, in its described place, in coordinates of the space.
struct Solid {
  std::int32_t object = 0;
  std::vector<Part> parts;  // empty if the space doesn't meet it
};

template <int N>
struct Cut {
  std::vector<HalfSpace<N>> planes;  // flat, rigid and at rest, including faces of boxes seen from inside
  std::vector<Ball> balls;           // rigid spheres at rest; only with N < 3
  std::vector<Solid> solids;
  std::vector<std::int32_t> missed;                           // objects that the space doesn't meet
  std::vector<std::pair<std::int32_t, std::int32_t>> joined;  // pairs of flush objects (seams.hpp)
};

// The only object of a scene, if it is a mesh at rest without a layer; else nullptr. In three dimensions such a mesh is
// rendered directly, without an obstacle or a Solid.
const MeshShape* lone_mesh(const Scene& scene);

// Throws SetupError if an object can't be cut; see section.hpp.
template <int N>
Cut<N> cut_by_space(const Scene& scene);
extern template Cut<1> cut_by_space<1>(const Scene&);
extern template Cut<2> cut_by_space<2>(const Scene&);
extern template Cut<3> cut_by_space<3>(const Scene&);

}  // namespace proxarm::scenes
