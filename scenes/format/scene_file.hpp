// Reads a scene's file; docs/scenes.md describes the format.
#pragma once

#include <filesystem>
#include <string_view>

#include "scenes/format/scene.hpp"

namespace proxarm::scenes {

// Throws description::SetupError with file, line and key for whatever isn't as it must be.
Scene load_scene(const std::filesystem::path& file);

// The same from text in memory; `file` is for messages and relative paths.
Scene parse_scene(std::string_view text, const std::filesystem::path& file);

}  // namespace proxarm::scenes
