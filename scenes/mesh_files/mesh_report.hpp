// Describes a loaded mesh: completely for `proxarm check`; before a session, only what may surprise the user.
#pragma once

#include <string>
#include <vector>

#include "scenes/mesh_files/mesh_file.hpp"

namespace proxarm::scenes {

// Returns one line each for faces, size, holes with their places and sizes, wrong edges and faces, and a guess of the
// unit. Takes as long as loading the mesh.
std::vector<std::string> mesh_report(const LoadedMesh& mesh);

// Returns size and place as text: "200 mm × 100 mm × 50 mm, from x 0, y 0, z 0 m to x 0.2, y 0.1, z 0.05 m".
std::string box_text(const models::TriangleMesh& mesh);

// For a mesh of 200 m or more, or of 0.2 mm or less, returns the scale_m that is probably meant. (Objects for an arm of
// a few metres are larger than 0.2 mm and smaller than 200 m.) If there is a cell, `run` and `check` compare meshes
// with the arm's reach instead (mesh_surprises()).
std::vector<std::string> unit_hints(const models::TriangleMesh& mesh, double scale);

// True if the mesh may be used with a rigid tool (models/mesh/mesh_topology.hpp). A point tool can use any mesh.
bool is_a_body(const LoadedMesh& mesh);

// Returns reports of two problems; empty for most meshes. The first problem: an open mesh has holes that are hardly
// visible, but through which a proxy falls. The second: the mesh is at least 30 times as large as the arm's reach, or
// at most a 3000th of it, so its unit isn't the scene's. The check costs nothing for a closed mesh.
std::vector<std::string> mesh_surprises(const models::TriangleMesh& mesh, double reach_m, double scale);

}  // namespace proxarm::scenes
