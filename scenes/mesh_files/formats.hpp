// The three formats: bytes in, triangles and what became of each face out. Throw std::runtime_error with what is wrong
// and where. Files are untrusted: call these in a sandbox (sandbox.hpp), which bounds time and memory.
#pragma once

#include <string_view>

#include "scenes/mesh_files/face_account.hpp"

namespace proxarm::scenes {

// STL, binary or text (3D Systems, Stereolithography Interface Specification, 1989). Binary is what has the length that
// the count in its header asks for, whether it begins with "solid" or not.
ParsedMesh parse_stl(std::string_view bytes);

// OBJ (Alias|Wavefront, Object Files, version 3.0): vertices and polygons. Free-form curves and surfaces are refused.
ParsedMesh parse_obj(std::string_view bytes);

// PLY 1.0 (G. Turk, Stanford 1994), text or binary of either byte order: the elements vertex, face and tristrips.
ParsedMesh parse_ply(std::string_view bytes);

}  // namespace proxarm::scenes
