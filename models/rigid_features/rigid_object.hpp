// The objects that a rigid tool can touch. RigidWorld is built from them.
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

// The features of a mesh: faces, edges and vertices. A closed mesh is the surface of a body and holds the tool on one
// side; an open mesh holds it on both sides, as for a point proxy. An edge or a vertex whose faces all lie in one plane
// is left out, because the tool's points and edges meet the faces first.
class TriangleFeatures {
 public:
  struct Edge {
    EdgeLine line;
    bool ridge = true;  // as seen from the front of the faces; false: a valley, which is a ridge as seen from behind
  };

  // Throws std::invalid_argument if more than two faces of a closed mesh share an edge, or if the fronts of some faces
  // are outside and those of others inside.
  explicit TriangleFeatures(std::shared_ptr<const TriangleMesh> mesh);

  [[nodiscard]] const TriangleMesh& mesh() const noexcept { return *mesh_; }
  // Returns 1 if the mesh is closed and the fronts of its faces are outside, −1 if they are inside, 0 if the mesh is
  // open.
  [[nodiscard]] double outwards() const noexcept { return outwards_; }
  [[nodiscard]] std::size_t edges() const noexcept { return edges_.size(); }
  [[nodiscard]] const Edge& edge(std::uint32_t i) const noexcept { return edges_[i]; }
  [[nodiscard]] const std::array<std::uint32_t, 2>& ends(std::uint32_t edge) const noexcept { return ends_[edge]; }
  [[nodiscard]] const Vec3& vertex(std::uint32_t i) const noexcept { return mesh_->vertex(i); }
  // Returns the normal cone of a vertex, made of the normals at the fronts of its faces. For an open mesh the cone
  // contains all directions.
  [[nodiscard]] const NormalCone& cone(std::uint32_t vertex) const noexcept { return cones_.of_corners[vertex]; }
  [[nodiscard]] const NormalCone::Angle& around(std::uint32_t face) const noexcept { return cones_.around_faces[face]; }
  // Returns which edges of a face are valleys, as seen from its front (`side` is 1) or from behind (−1). Bit k belongs
  // to the edge from corner k to the next corner.
  [[nodiscard]] std::uint8_t valleys_of(std::uint32_t face, double side) const noexcept {
    return bends_[face][side > 0.0 ? 0 : 1];
  }
  // Return the edges and vertices that a face owns. Each edge and each vertex has exactly one owner.
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
  NormalCones cones_;  // for an open mesh each cone contains all directions
  std::vector<Edge> edges_;
  std::vector<std::array<std::uint32_t, 2>> ends_;  // for each edge, its two vertices
  std::vector<std::array<std::uint8_t, 2>> bends_;  // for each face, the bits of its valleys and the bits of its ridges
  std::vector<std::uint32_t> owned_edges_, first_edge_, owned_vertices_, first_vertex_;
};

// An object's motion relative to its described place. It follows a script, or the caller drives the object.
struct RigidMotion {
  ScriptedMotion script;
  bool driven = false;  // the caller drives the object, and `script` is ignored
};

struct RigidObject {
  // In W, at the pose in the scene's file. A hollow object may need several RigidObjects: a box from inside is six flat
  // sides.
  std::variant<FlatSide, HollowSphere, HollowTube, Solid, std::shared_ptr<const TriangleFeatures>> shape;
  double friction = 0.0;
  std::int32_t object = 0;  // the object's number, which contacts report
  bool inside_out = false;  // closed meshes only: the tool is inside the mesh. Ignored for other shapes
  std::optional<RigidMotion> motion{};
};

// Calls function(shape) if the object's shape is flat or hollow; only points and rims of the tool touch such shapes.
// (std::visit isn't used because it may throw.)
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
