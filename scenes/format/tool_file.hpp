// The tool that the arm holds, as in its file: shapes fixed to each other, in the tool's frame T, whose origin is the
// rendered point. docs/tool.md describes the keys.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "models/rigid_shapes/tool.hpp"

namespace proxarm::description {
class YamlNode;
}

namespace proxarm::scenes {

struct RigidTool {
  std::filesystem::path file;  // for messages
  int line = 0;
  std::string name;
  models::Tool shape;                         // at least one part
  std::vector<std::filesystem::path> meshes;  // files of its meshes, also of those used for hulls
};

// From a tool file, or from a scene's key `tool`. Throws description::SetupError with file, line and key.
RigidTool load_tool(const std::filesystem::path& file);
RigidTool read_tool(const description::YamlNode& node);

// Keys for a tool's shape; several shapes are listed under `parts`.
const std::vector<std::string>& tool_kinds();

}  // namespace proxarm::scenes
