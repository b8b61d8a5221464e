// Reads scene files; docs/scenes.md describes the format.
#pragma once

#include <filesystem>
#include <string_view>

#include "scenes/format/scene.hpp"

namespace proxarm::scenes {

// Throws description::SetupError with file, line and key for invalid contents.
Scene load_scene(const std::filesystem::path& file);
// Replaces the scene's tool: an empty path means a point, the scene's file its own tool, another file its tool.
Scene load_scene_with(const std::filesystem::path& file, const std::filesystem::path& tool);

// The same from text in memory; `file` is used in messages and for relative paths.
Scene parse_scene(std::string_view text, const std::filesystem::path& file);

}  // namespace proxarm::scenes
