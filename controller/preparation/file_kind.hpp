// Recognizes the kind of a file, so that an error message can say that a file was given in the wrong place.
#pragma once

#include <filesystem>

namespace proxarm::controller {

enum class FileKind { cell, scene, tool, hand, sensor, registers, urdf, eds, dbc, mesh, unknown };

// Recognizes a file's kind by the extension, or by a key that only one kind of file has. Returns `unknown` if there is
// no such key, or if the file can't be read.
FileKind kind_of(const std::filesystem::path& file);

// Throws SetupError if the file is clearly of another kind than `expected` (cell, scene or hand). The error says with
// which option a file of the other kind is given.
void require_kind(const std::filesystem::path& file, FileKind expected);

}  // namespace proxarm::controller
