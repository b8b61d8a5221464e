// Reads a scene's file; docs/scenes.md describes the format.
#pragma once

#include <filesystem>
#include <string_view>

#include "scenes/format/scene.hpp"

namespace proxarm::scenes {

// Throws description::SetupError with file, line and key for whatever isn't as it must be.
Scene load_scene(const std::filesystem::path& file);
// With the tool of this file, whoever named it: none of an empty path, the scene's own of the scene's file.
Scene load_scene_with(const std::filesystem::path& file, const std::filesystem::path& tool);

// The same from text in memory; `file` is for messages and relative paths.
Scene parse_scene(std::string_view text, const std::filesystem::path& file);

}  // namespace proxarm::scenes
