// The tool that an arm holds, as a file states it: shapes that are fixed to each other, in the tool's frame T, whose
// origin is the rendered point. docs/tool.md has the keys.
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
  std::filesystem::path file;  // that it was read from, for messages
  int line = 0;
  std::string name;
  models::Tool shape;                         // one part or more
  std::vector<std::filesystem::path> meshes;  // that it is made of, or whose vertices span a hull
};

// Of a file of its own, or of a scene's key `tool`. Throw description::SetupError with file, line and key.
RigidTool load_tool(const std::filesystem::path& file);
RigidTool read_tool(const description::YamlNode& node);

// The keys of a tool's shapes; several shapes stand under `parts`.
const std::vector<std::string>& tool_kinds();

}  // namespace proxarm::scenes
