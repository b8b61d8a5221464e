// What kind of file somebody has given, so that one in the wrong place is told by its name.
#pragma once

#include <filesystem>

namespace proxarm::command_line {

enum class FileKind { cell, scene, tool, hand, sensor, registers, urdf, eds, dbc, mesh, unknown };

// By its extension, or by a key that only its kind has. A YAML file without any, or that can't be read: unknown.
FileKind kind_of(const std::filesystem::path& file);

// Throws SetupError if the file is clearly of another kind than `expected` (cell, scene or hand), with where that kind
// is given.
void require_kind(const std::filesystem::path& file, FileKind expected);

}  // namespace proxarm::command_line
