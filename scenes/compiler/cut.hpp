// The part of a scene that lies within the proxy's space, sorted by how it is rendered. In three dimensions this is the
// whole scene; in fewer dimensions it consists of sections (section.hpp).
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "scenes/compiler/obstacles.hpp"

namespace proxarm::scenes {

// A half-space of the proxy's space: the section of a plane's half-space in W.
template <int N>
struct HalfSpace {
  std::int32_t object = 0;   // index of the object in the scene
  std::int32_t feature = 0;  // index of the feature of the object
  models::Vec<N> point = models::Vec<N>::Zero();
  models::Vec<N> normal = models::Vec<N>::Zero();
};

// The section of a sphere: a sphere of fewer dimensions.
struct Ball {
  std::int32_t object = 0;
  models::Vec3 centre = models::Vec3::Zero();  // in coordinates of the space, padded with zeros
  double radius_m = 0.0;
  bool inside_out = false;
};

// Any other object, in its described place and in coordinates of the space.
struct Solid {
  std::int32_t object = 0;
  std::vector<Part> parts;  // empty if the space doesn't meet the object
};

template <int N>
struct Cut {
  // Flat surfaces that are rigid and at rest, including the faces of boxes seen from inside.
  std::vector<HalfSpace<N>> planes;
  std::vector<Ball> balls;  // rigid spheres at rest; only with N < 3
  std::vector<Solid> solids;
  std::vector<std::int32_t> missed;                           // objects that the space doesn't meet
  std::vector<std::pair<std::int32_t, std::int32_t>> joined;  // pairs of flush objects that act as one (seams.hpp)
};

// Returns the only object of a scene if it is a mesh at rest without a layer; else nullptr. In three dimensions such a
// mesh is rendered directly, without an obstacle or a Solid.
const MeshShape* lone_mesh(const Scene& scene);

// Throws SetupError if the section of an object can't be rendered; see section.hpp.
template <int N>
Cut<N> cut_by_space(const Scene& scene);
extern template Cut<1> cut_by_space<1>(const Scene&);
extern template Cut<2> cut_by_space<2>(const Scene&);
extern template Cut<3> cut_by_space<3>(const Scene&);

}  // namespace proxarm::scenes
