// What there is to say of a mesh that was read: for `proxarm check`, everything; before a session, what would surprise.
#pragma once

#include <string>
#include <vector>

#include "scenes/mesh_files/mesh_file.hpp"

namespace proxarm::scenes {

// All of it, a line each: faces, size, holes with places and sizes, edges and faces that are wrong, a guess of the
// unit. Takes as long as loading the mesh.
std::vector<std::string> mesh_report(const LoadedMesh& mesh);

// Where it lies: "200 mm × 100 mm × 50 mm, from x 0, y 0, z 0 m to x 0.2, y 0.1, z 0.05 m".
std::string box_text(const models::TriangleMesh& mesh);

// Of a mesh of 200 m and more, or of 0.2 mm and less: the scale_m that is probably meant. What an arm of some metres
// touches is in between; `run` and `check` of a cell hold meshes against the arm's own reach (mesh_surprises()).
std::vector<std::string> unit_hints(const models::TriangleMesh& mesh, double scale);

// Whether it may be with a rigid tool (models/mesh/mesh_topology.hpp). A point tool takes any mesh.
bool is_a_body(const LoadedMesh& mesh);

// Of an open mesh: holes that are small against it, through which a proxy falls though they can hardly be seen. And a
// mesh that is hundreds of times as large as what the arm reaches (or a thousandth of it), which is in another unit
// than the scene takes it for. Empty for most meshes; of one that is closed it costs nothing.
std::vector<std::string> mesh_surprises(const models::TriangleMesh& mesh, double reach_m, double scale);

}  // namespace proxarm::scenes
