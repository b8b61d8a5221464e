// A rigid tool as a cell or a scene describes it: shapes that are fixed to each other. Plain data in metres, in the
// tool's frame, whose origin is the reference point.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "models/geometry/geometry.hpp"

namespace proxarm::models {

struct SphereTool {
  double radius_m = 0.0;
};
// All points within radius_m of a segment. The segment has the length length_m along z and is centred at the origin.
struct CapsuleTool {
  double length_m = 0.0;
  double radius_m = 0.0;
};
struct BoxTool {
  Vec3 size_m = Vec3::Zero();  // full lengths of the edges
};
// A cylinder with flat ends along z, centred at the origin.
struct CylinderTool {
  double length_m = 0.0;
  double radius_m = 0.0;
};
// The convex hull of points. Precondition: four of the points span a solid.
struct ConvexTool {
  std::vector<Vec3> points_m;
};
// A closed surface of triangles, which may have dents and holes through the body.
struct MeshTool {
  std::vector<Vec3> points_m;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

struct ToolPart {
  std::variant<SphereTool, CapsuleTool, BoxTool, CylinderTool, ConvexTool, MeshTool> shape;
  Pose X_TP = Pose::Identity();  // pose of the shape in the tool's frame
  // The friction of a contact is √(μ_tool μ_object), with this value as μ_tool. Without a value, the friction is
  // μ_object.
  std::optional<double> friction;
};

// One part, or several parts (a compound). Without a part, the tool is a point.
struct Tool {
  std::vector<ToolPart> parts;
};

}  // namespace proxarm::models
