// Recognizes the kind of a file, so that an error can name a file given in the wrong place.
#pragma once

#include <filesystem>

namespace proxarm::command_line {

enum class FileKind { cell, scene, tool, hand, sensor, registers, urdf, eds, dbc, mesh, unknown };

// Recognizes a file by its extension, or by a key that only its kind has. Unknown: no such key, or the file can't be
// read.
FileKind kind_of(const std::filesystem::path& file);

// Throws SetupError if the file is clearly of another kind than `expected` (cell, scene or hand). The error says how to
// give a file of that other kind.
void require_kind(const std::filesystem::path& file, FileKind expected);

}  // namespace proxarm::command_line
