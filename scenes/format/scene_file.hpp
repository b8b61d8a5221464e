// Reads scene files; docs/reference/scenes.md describes the format.
#pragma once

#include <filesystem>
#include <string_view>

#include "scenes/format/scene.hpp"

namespace proxarm::scenes {

// Loads a scene. Throws description::SetupError with file, line and key if the contents are invalid.
Scene load_scene(const std::filesystem::path& file);
// Loads a scene and replaces its tool. If `tool` is empty, the tool becomes a point. If `tool` is the scene's file, the
// scene keeps its own tool. Else `tool` is a tool file.
Scene load_scene_with(const std::filesystem::path& file, const std::filesystem::path& tool);

// Parses a scene from text in memory. `file` is used in messages and for relative paths.
Scene parse_scene(std::string_view text, const std::filesystem::path& file);

}  // namespace proxarm::scenes
