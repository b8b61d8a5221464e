// Measures how deep a solid or a mesh stands in another mesh. It is used at the setup and after each step.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "models/rigid_features/node_discs.hpp"
#include "models/rigid_features/rigid_features.hpp"

namespace proxarm::models {

// Normals of planes that separated a solid from triangles of a mesh, in the mesh's frame, pointing away from the solid.
// If solid and mesh have hardly moved since the planes were found, most of these planes still separate them.
struct PlanesBetween {
  std::array<Vec3, 12> normals;
  std::size_t count = 0;
};

// Keeps the separating planes of the last eight pairs of a part of the tool and an object.
class LastPlanes {
 public:
  [[nodiscard]] PlanesBetween& of(std::uint16_t part, std::uint16_t entry) noexcept {
    for (Known& known : known_) {
      if (known.part == part && known.entry == entry) return known.planes;
    }
    Known& known = known_[next_++ % known_.size()];
    known.part = part;
    known.entry = entry;
    known.planes.count = 0;
    return known.planes;
  }

 private:
  struct Known {
    std::uint16_t part = 0xFFFF, entry = 0xFFFF;  // no part and no object
    PlanesBetween planes;
  };
  std::array<Known, 8> known_;
  std::size_t next_ = 0;
};

// Says when a triangle counts as apart from the solid, and helps to find out quickly.
struct Apart {
  // A triangle is apart if its gap to the solid is larger than this, m; 0 or negative.
  double enough = 0.0;
  // Normals of planes to try first, in the mesh's frame, pointing away from the solid.
  std::span<const Vec3> normals{};
  // If not null: the planes found by the last call, to try next. They are replaced by those of this call.
  PlanesBetween* last = nullptr;
  // If given, only these triangles are tested. They must include all triangles that the solid may meet.
  std::optional<std::span<const std::uint32_t>> triangles{};
};

// Returns how deep a solid stands in a mesh, as a negative number in m, or 0. There are three cases:
// 1. The solid stands in some triangles: the result is the deepest of these overlaps.
// 2. It stands in none, but its first point (of a cylinder: the centre of its first rim) is on the wrong side of the
//    surface, by `should_be_inside`: the result is minus the distance of this point from the surface.
// 3. Neither: 0.
// `box` is the box around the solid's points, in the solid's frame. `at` transforms from the solid's frame into the
// mesh's. An open mesh has no inside: `should_be_inside` must then be nullopt.
double overlap_with_mesh(const Solid& solid, const Bounds& box, const TriangleMesh& mesh, const View& at,
                         std::optional<bool> should_be_inside, const Apart& apart = {}) noexcept;
// Returns how deep the mesh `own`, a closed body, stands in the mesh `other`, as overlap_with_mesh() does. `at`
// transforms from the frame of `own` into the frame of `other`.
double overlap_of_meshes(const FlatMesh& own, const FlatMesh& other, const View& at,
                         std::optional<bool> should_be_inside) noexcept;
// The two tests of overlap_of_meshes(): overlap_of_faces() tests one triangle of each mesh. overlap_of_all() tests
// whether one whole mesh is on the wrong side of the other mesh.
double overlap_of_faces(const TriangleMesh& own, std::uint32_t face, const TriangleMesh& other,
                        std::uint32_t other_face, const View& at) noexcept;
double overlap_of_all(const TriangleMesh& own, const TriangleMesh& other, const View& at,
                      std::optional<bool> should_be_inside) noexcept;

}  // namespace proxarm::models
