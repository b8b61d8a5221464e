// A rigid tool as a cell or a scene states it: shapes that are fixed to each other. Plain data; metres, in the tool's
// frame, whose origin is the reference point.
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
// All points within radius_m of a segment of length_m along z, about the middle.
struct CapsuleTool {
  double length_m = 0.0;
  double radius_m = 0.0;
};
struct BoxTool {
  Vec3 size_m = Vec3::Zero();  // full edges
};
// With flat ends, along z, about the middle.
struct CylinderTool {
  double length_m = 0.0;
  double radius_m = 0.0;
};
// The convex hull of points, four of which span a solid.
struct ConvexTool {
  std::vector<Vec3> points_m;
};
// A closed surface of triangles, dents and holes included.
struct MeshTool {
  std::vector<Vec3> points_m;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

struct ToolPart {
  std::variant<SphereTool, CapsuleTool, BoxTool, CylinderTool, ConvexTool, MeshTool> shape;
  Pose X_TP = Pose::Identity();  // of the shape in the tool's frame
  // Friction of a contact is √(μ_tool μ_object); without a value here it is the object's.
  std::optional<double> friction;
};

// One part, or several (a compound). No part: the tool is a point.
struct Tool {
  std::vector<ToolPart> parts;
};

}  // namespace proxarm::models
