// Holds the constant data of a rigid world: the parts of the tool and the objects, with their bounds.
#pragma once

#include <cstddef>
#include <limits>
#include <memory>
#include <optional>
#include <variant>
#include <vector>

#include "models/rigid_features/node_discs.hpp"
#include "models/rigid_features/rigid_object.hpp"
#include "models/rigid_shapes/cylinder.hpp"
#include "models/rigid_shapes/tool.hpp"

namespace proxarm::models {

// A part of the tool, in T.
struct RigidPart {
  Solid solid;  // for a mesh: also its vertices, edges and faces
  Bounds box;   // box around the solid's points
  std::optional<double> friction;
  std::shared_ptr<const TriangleFeatures> mesh{};
  std::optional<Cylinder> cylinder{};
  NodeDiscs discs{};  // for a mesh, if an object is a mesh, too; else empty
};

// An object, in its frame.
struct RigidEntry {
  RigidObject object;
  Bounds bounds;      // box around the whole object; infinite if the object is flat or hollow
  Bounds box{};       // box around the points of a solid, or around a mesh
  double held = 0.0;  // for a closed mesh: the side of its faces on which the tool is, 1 or −1
  std::optional<Cylinder> cylinder{};
  NodeDiscs discs{};  // for a mesh, if a part of the tool is a mesh, too; else empty

  // Return null if the object has another shape.
  [[nodiscard]] const Solid* solid() const noexcept { return std::get_if<Solid>(&object.shape); }
  [[nodiscard]] const TriangleFeatures* mesh() const noexcept {
    const auto* mesh = std::get_if<std::shared_ptr<const TriangleFeatures>>(&object.shape);
    return mesh != nullptr ? mesh->get() : nullptr;
  }
};

// Precondition: the part or the entry is a mesh, and both the tool and the objects of the setup have meshes.
inline FlatMesh flat_mesh(const RigidPart& part) noexcept { return {part.mesh->mesh(), part.discs}; }
inline FlatMesh flat_mesh(const RigidEntry& entry) noexcept { return {entry.mesh()->mesh(), entry.discs}; }

struct RigidSetup {
  std::vector<RigidPart> parts;
  std::vector<RigidEntry> entries;  // first the objects that can't move
  std::size_t first_moving = 0;     // index of the first entry that can move
  double reach_m = 0.0;             // largest distance of a point of the tool from the reference point
  double thinness_m = std::numeric_limits<double>::infinity();  // thickness of the thinnest part or solid object, m
  bool hollow = false;                                          // an object is a hollow sphere or tube
  bool bends = false;  // an object is hollow or a body has a rim, so the gaps' curvature counts
  // a round edge may meet another edge, so the curvature counts if the edges are nearly parallel
  bool edges_bend = false;
  bool dense = false;  // there is a mesh, or solids have many corners, so many features may be near
  bool mesh_tool = false, mesh_objects = false;  // a part of the tool is a mesh; an object is a mesh
};

// Throws std::invalid_argument as RigidWorld's constructor states.
RigidSetup rigid_setup(const Tool& tool, std::vector<RigidObject> objects);

}  // namespace proxarm::models
