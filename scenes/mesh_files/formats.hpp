// Parsers of the three mesh formats. They convert bytes to triangles and count how each face was used. They throw
// std::runtime_error with the problem and its place in the file. Files are untrusted, so the parsers must be called in
// a sandbox (sandbox.hpp), which limits time and memory.
#pragma once

#include <string_view>

#include "scenes/mesh_files/face_account.hpp"

namespace proxarm::scenes {

// Parses STL, binary or text (3D Systems, Stereolithography Interface Specification, 1989). A file counts as binary if
// its length matches the count in its header, even if the file begins with "solid".
ParsedMesh parse_stl(std::string_view bytes);

// Parses OBJ (Alias|Wavefront, Object Files, version 3.0): vertices and polygons. Free-form curves and surfaces are
// refused.
ParsedMesh parse_obj(std::string_view bytes);

// Parses PLY 1.0 (G. Turk, Stanford 1994), text or binary of either byte order: the elements vertex, face and
// tristrips.
ParsedMesh parse_ply(std::string_view bytes);

}  // namespace proxarm::scenes
