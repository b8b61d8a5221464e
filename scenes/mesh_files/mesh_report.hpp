// Describes a loaded mesh: completely for `proxarm check`; before a session, only what may surprise the user.
#pragma once

#include <string>
#include <vector>

#include "scenes/mesh_files/mesh_file.hpp"

namespace proxarm::scenes {

// One line each: faces, size, holes with places and sizes, wrong edges and faces, a guess of the unit. Takes as long as
// loading the mesh.
std::vector<std::string> mesh_report(const LoadedMesh& mesh);

// Size and place: "200 mm × 100 mm × 50 mm, from x 0, y 0, z 0 m to x 0.2, y 0.1, z 0.05 m".
std::string box_text(const models::TriangleMesh& mesh);

// For a mesh of 200 m or more, or 0.2 mm or less: the scale_m that is probably meant. Objects for an arm of some metres
// are in between. With a cell, `run` and `check` compare meshes with the arm's reach (mesh_surprises()).
std::vector<std::string> unit_hints(const models::TriangleMesh& mesh, double scale);

// True if the mesh may be used with a rigid tool (models/mesh/mesh_topology.hpp). A point tool takes any mesh.
bool is_a_body(const LoadedMesh& mesh);

// Reports holes of an open mesh that are hardly visible although a proxy falls through. Also reports a mesh that is at
// least 30 times as large as the arm's reach, or a 3000th of it, and so has another unit than in the scene. Empty for
// most meshes; costs nothing for a closed one.
std::vector<std::string> mesh_surprises(const models::TriangleMesh& mesh, double reach_m, double scale);

}  // namespace proxarm::scenes
