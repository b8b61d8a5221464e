// Whether what should be apart stands in a mesh: for setting up, and after a step.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "models/rigid_features/node_discs.hpp"
#include "models/rigid_features/rigid_features.hpp"

namespace proxarm::models {

// Normals of planes that lay between a solid and triangles of a mesh, away from the solid, in the mesh's frame. Where
// both have hardly moved since, most of them do so again.
struct PlanesBetween {
  std::array<Vec3, 12> normals;
  std::size_t count = 0;
};

// Of the last few parts of the tool and objects that were looked at.
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
    std::uint16_t part = 0xFFFF, entry = 0xFFFF;  // none
    PlanesBetween planes;
  };
  std::array<Known, 8> known_;
  std::size_t next_ = 0;
};

// What counts as apart: a triangle that stands in the solid by no more than −`enough`. Those are looked for first by
// planes with such normals, away from the solid, of the mesh's frame; and by the last ones that were found.
struct Apart {
  double enough = 0.0;
  std::span<const Vec3> normals{};
  PlanesBetween* last = nullptr;
  // Of the triangles that the solid may meet, if they are known; it may hold others.
  std::optional<std::span<const std::uint32_t>> triangles{};
};

// The deepest that a solid (with the box of its points; `at` leads from its frame to the mesh's) stands in any triangle
// of a mesh, or how far its first point is from the surface if it isn't inside or outside as it should be. Negative; 0
// if neither. An open mesh has no inside.
double overlap_with_mesh(const Solid& solid, const Bounds& box, const TriangleMesh& mesh, const View& at,
                         std::optional<bool> should_be_inside, const Apart& apart = {}) noexcept;
// Of two meshes the same; the own one is a closed body.
double overlap_of_meshes(const FlatMesh& own, const FlatMesh& other, const View& at,
                         std::optional<bool> should_be_inside) noexcept;
// The two things that it looks at: one triangle of each, and whether one mesh is all on the wrong side of the other.
double overlap_of_faces(const TriangleMesh& own, std::uint32_t face, const TriangleMesh& other,
                        std::uint32_t other_face, const View& at) noexcept;
double overlap_of_all(const TriangleMesh& own, const TriangleMesh& other, const View& at,
                      std::optional<bool> should_be_inside) noexcept;

}  // namespace proxarm::models
