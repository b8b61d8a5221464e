// The tool that the arm holds, as its file describes it: shapes that are fixed to each other. They are in the tool's
// frame T, whose origin is the rendered point. docs/how_to/tool.md describes the keys.
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
  std::filesystem::path file;  // file for messages
  int line = 0;
  std::string name;
  models::Tool shape;                         // has at least one part
  std::vector<std::filesystem::path> meshes;  // files of the tool's meshes, including meshes used for hulls
};

// Load a tool from a tool file, or read it from a scene's key `tool`. Throw description::SetupError with file, line and
// key.
RigidTool load_tool(const std::filesystem::path& file);
RigidTool read_tool(const description::YamlNode& node);

// Returns the keys that describe a tool's shape. If a tool has several shapes, they are listed under `parts`.
const std::vector<std::string>& tool_kinds();

}  // namespace proxarm::scenes
