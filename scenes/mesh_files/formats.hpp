// Parsers of the three mesh formats: from bytes to triangles, with a count of how each face was used. They throw
// std::runtime_error with problem and place. Files are untrusted: call these in a sandbox (sandbox.hpp), which limits
// time and memory.
#pragma once

#include <string_view>

#include "scenes/mesh_files/face_account.hpp"

namespace proxarm::scenes {

// STL, binary or text (3D Systems, Stereolithography Interface Specification, 1989). A file is binary if its length
// matches the count in its header, even if it begins with "solid".
ParsedMesh parse_stl(std::string_view bytes);

// OBJ (Alias|Wavefront, Object Files, version 3.0): vertices and polygons. Free-form curves and surfaces are refused.
ParsedMesh parse_obj(std::string_view bytes);

// PLY 1.0 (G. Turk, Stanford 1994), text or binary of either byte order: the elements vertex, face and tristrips.
ParsedMesh parse_ply(std::string_view bytes);

}  // namespace proxarm::scenes
