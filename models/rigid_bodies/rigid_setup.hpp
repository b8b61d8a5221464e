// What is constant in a rigid world: the parts of the tool and the objects, with their bounds.
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
  Solid solid;  // a mesh's vertices, edges and faces stand here as well
  Bounds box;   // of the solid's points
  std::optional<double> friction;
  std::shared_ptr<const TriangleFeatures> mesh{};
  std::optional<Cylinder> cylinder{};
  NodeDiscs discs{};  // of a mesh, if an object is a mesh, too
};

// An object, in its frame.
struct RigidEntry {
  RigidObject object;
  Bounds bounds;      // of the whole object; infinite if it is flat or hollow
  Bounds box{};       // of a solid's points, or of a mesh
  double held = 0.0;  // of a closed mesh: 1 or −1, the side of its faces on which the tool is
  std::optional<Cylinder> cylinder{};
  NodeDiscs discs{};  // of a mesh, if a part of the tool is a mesh, too

  // Null if the object has another shape.
  [[nodiscard]] const Solid* solid() const noexcept { return std::get_if<Solid>(&object.shape); }
  [[nodiscard]] const TriangleFeatures* mesh() const noexcept {
    const auto* mesh = std::get_if<std::shared_ptr<const TriangleFeatures>>(&object.shape);
    return mesh != nullptr ? mesh->get() : nullptr;
  }
};

// Precondition: it is a mesh, and the setup has meshes on both sides.
inline FlatMesh flat_mesh(const RigidPart& part) noexcept { return {part.mesh->mesh(), part.discs}; }
inline FlatMesh flat_mesh(const RigidEntry& entry) noexcept { return {entry.mesh()->mesh(), entry.discs}; }

struct RigidSetup {
  std::vector<RigidPart> parts;
  std::vector<RigidEntry> entries;  // first those that stand still
  std::size_t first_moving = 0;     // index of the first entry that moves
  double reach_m = 0.0;             // largest distance of a point of the tool from the reference point
  double thinness_m = std::numeric_limits<double>::infinity();  // least thickness of all parts and solid objects
  bool hollow = false;                                          // an object is a hollow sphere or tube
  bool bends = false;       // an object is hollow or a body has a rim: the gaps' curvature counts
  bool edges_bend = false;  // a round edge may meet another edge: the curvature counts where they nearly align
  bool dense = false;       // there is a mesh, or solids have many corners: much may be near
  bool mesh_tool = false, mesh_objects = false;
};

// Throws std::invalid_argument as RigidWorld's constructor states.
RigidSetup rigid_setup(const Tool& tool, std::vector<RigidObject> objects);

}  // namespace proxarm::models
