// What a rigid tool can touch, as RigidWorld is built from it.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <variant>
#include <vector>

#include "models/geometry/scripted_motion.hpp"
#include "models/mesh/mesh.hpp"
#include "models/rigid_shapes/normal_cone.hpp"
#include "models/rigid_shapes/touch.hpp"

namespace proxarm::models {

// A surface of triangles. Of a closed one, a body's, one side holds; of an open one both, as for a point proxy. Only
// what can be touched counts: an edge or a vertex whose faces lie in one plane is left out, since the tool's points and
// edges meet the faces first.
class TriangleFeatures {
 public:
  struct Edge {
    EdgeLine line;
    bool ridge = true;  // seen from the faces' front; otherwise a valley, which is a ridge from behind
  };

  // Throws std::invalid_argument for a closed mesh with an edge that more than two faces share, or with faces of which
  // some have their fronts outside and others inside.
  explicit TriangleFeatures(std::shared_ptr<const TriangleMesh> mesh);

  [[nodiscard]] const TriangleMesh& mesh() const noexcept { return *mesh_; }
  // Of a closed mesh: 1 if its faces' fronts are outside, −1 if inside. Of an open one: 0.
  [[nodiscard]] double outwards() const noexcept { return outwards_; }
  [[nodiscard]] std::size_t edges() const noexcept { return edges_.size(); }
  [[nodiscard]] const Edge& edge(std::uint32_t i) const noexcept { return edges_[i]; }
  [[nodiscard]] const std::array<std::uint32_t, 2>& ends(std::uint32_t edge) const noexcept { return ends_[edge]; }
  [[nodiscard]] const Vec3& vertex(std::uint32_t i) const noexcept { return mesh_->vertex(i); }
  // Of a body's vertex, as seen from its faces' fronts.
  [[nodiscard]] const NormalCone& cone(std::uint32_t vertex) const noexcept { return cones_.of_corners[vertex]; }
  [[nodiscard]] const NormalCone::Angle& around(std::uint32_t face) const noexcept { return cones_.around_faces[face]; }
  // Which of a face's edges are valleys, seen from its front (side 1) or from behind (−1): bit k for the one from
  // corner k to the next.
  [[nodiscard]] std::uint8_t valleys_of(std::uint32_t face, double side) const noexcept {
    return bends_[face][side > 0.0 ? 0 : 1];
  }
  // The edges and vertices that a face owns; each belongs to one face.
  [[nodiscard]] std::span<const std::uint32_t> edges_of(std::uint32_t face) const noexcept {
    return owned(owned_edges_, first_edge_, face);
  }
  [[nodiscard]] std::span<const std::uint32_t> vertices_of(std::uint32_t face) const noexcept {
    return owned(owned_vertices_, first_vertex_, face);
  }

 private:
  [[nodiscard]] static std::span<const std::uint32_t> owned(const std::vector<std::uint32_t>& all,
                                                            const std::vector<std::uint32_t>& first,
                                                            std::uint32_t face) noexcept {
    return std::span(all).subspan(first[face], first[face + 1] - first[face]);
  }

  [[nodiscard]] double front_side() const;

  std::shared_ptr<const TriangleMesh> mesh_;
  double outwards_ = 0.0;
  NormalCones cones_;  // of a body; of an open mesh they hold any direction
  std::vector<Edge> edges_;
  std::vector<std::array<std::uint32_t, 2>> ends_;  // of each edge, its vertices
  std::vector<std::array<std::uint8_t, 2>> bends_;  // of each face, its valleys and its ridges
  std::vector<std::uint32_t> owned_edges_, first_edge_, owned_vertices_, first_vertex_;
};

// By a script, or driven from outside; relative to where the object was described.
struct RigidMotion {
  ScriptedMotion script;
  bool driven = false;  // the script doesn't count
};

struct RigidObject {
  // In W, where it was described. A hollow one may need several: a box from inside is six sides.
  std::variant<FlatSide, HollowSphere, HollowTube, Solid, std::shared_ptr<const TriangleFeatures>> shape;
  double friction = 0.0;
  std::int32_t object = 0;  // what contacts report
  bool inside_out = false;  // of a closed mesh: the tool is inside of it. Other shapes say that by themselves
  std::optional<RigidMotion> motion{};
};

// Calls with the object's shape where that is one that a point alone is held by: flat or hollow. (std::visit may
// throw.)
template <typename Function>
void with_flat_or_hollow(const RigidObject& object, Function function) noexcept {
  if (const auto* flat = std::get_if<FlatSide>(&object.shape)) {
    function(*flat);
  } else if (const auto* sphere = std::get_if<HollowSphere>(&object.shape)) {
    function(*sphere);
  } else if (const auto* tube = std::get_if<HollowTube>(&object.shape)) {
    function(*tube);
  }
}

}  // namespace proxarm::models
