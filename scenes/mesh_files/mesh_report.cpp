#include "scenes/mesh_files/mesh_report.hpp"

#include <algorithm>
#include <limits>

#include "models/base/setup_error.hpp"
#include "models/mesh/mesh_crossings.hpp"
#include "models/mesh/mesh_topology.hpp"

namespace proxarm::scenes {
namespace {

using models::MeshDefect;
using models::MeshHole;
using models::place_text;
using models::size_text;
using models::Vec3;

std::string counted(std::size_t count, const char* one, const char* several) {
  return std::to_string(count) + " " + (count == 1 ? one : several);
}

// Lists the first holes, which are the smallest: a user can see large holes without help.
std::string holes_text(const std::vector<MeshHole>& holes, std::size_t count) {
  constexpr std::size_t told = 5;
  std::string text;
  for (std::size_t k = 0; k < std::min(count, told); ++k) {
    text += (k == 0 ? "" : "; ") + size_text(holes[k].size_m) + " at " + place_text(holes[k].centre);
  }
  return count > told ? text + "; …" : text;
}

std::string borders_text(const std::vector<models::MeshBorder>& borders) {
  constexpr std::size_t told = 5;
  std::string text;
  for (std::size_t k = 0; k < std::min(borders.size(), told); ++k) {
    text += (k == 0 ? "a border of " : "; of ") + counted(borders[k].edges, "edge", "edges") + ", " +
            size_text(borders[k].length_m) + " long, at " + place_text(borders[k].centre);
  }
  return borders.size() > told ? text + "; …" : text;
}

void add(std::vector<std::string>& lines, const MeshDefect& defect, const char* one, const char* several) {
  if (defect.count == 0) return;
  lines.push_back(counted(defect.count, one, several) + ", " + (defect.count == 1 ? "" : "such as ") + "at " +
                  place_text(defect.first_W));
}

}  // namespace

std::string box_text(const models::TriangleMesh& mesh) {
  const models::Bounds box = mesh.bounds();
  const Vec3 size = box.high - box.low;
  return size_text(size.x()) + " × " + size_text(size.y()) + " × " + size_text(size.z()) + ", from " +
         place_text(box.low) + " to " + place_text(box.high);
}

std::vector<std::string> unit_hints(const models::TriangleMesh& mesh, double scale) {
  constexpr double large_m = 200.0, small_m = 0.2e-3;
  const double extent_m = (mesh.bounds().high - mesh.bounds().low).maxCoeff();
  const auto hint = [&](const char* looks, double factor) {
    return std::vector<std::string>{"it is " + size_text(extent_m) + " long: " + looks +
                                    "; write scale_m: " + description::number_text(scale * factor)};
  };
  if (extent_m >= large_m) return hint("looks like mm", 1e-3);
  if (extent_m <= small_m) return hint("looks like metres under a scale for mm", 1e3);
  return {};
}

std::vector<std::string> mesh_report(const LoadedMesh& loaded) {
  const models::TriangleMesh& mesh = *loaded.mesh;
  const models::MeshTopology found = models::topology_of(mesh);
  std::vector<std::string> lines{loaded.account.text()};
  lines.push_back(counted(mesh.size(), "triangle", "triangles") + " in " + counted(found.parts, "part", "parts") +
                  (mesh.closed() ? ", closed; " : ", open; ") + box_text(mesh));
  if (!found.holes.empty()) {
    lines.push_back(counted(found.holes.size(), "hole or border", "holes and borders") + ": " +
                    holes_text(found.holes, found.holes.size()));
  }
  if (!found.borders.empty()) {
    lines.push_back(counted(found.borders.size(), "border that ends", "borders that end") +
                    " at other faces: " + borders_text(found.borders));
  }
  add(lines, found.non_manifold, "edge with more than two faces", "edges with more than two faces");
  add(lines, found.flipped, "face turned against the others of its part (it holds all the same)",
      "faces turned against the others of their part (they hold all the same)");
  if (found.one_sided > 0) {
    lines.push_back(counted(found.one_sided, "part", "parts") + " without a front and a back, as a Möbius strip is");
  }
  if (found.inside_out > 0) {
    lines.push_back(counted(found.inside_out, "closed part", "closed parts") + " with the fronts of all faces inside");
  }
  for (const std::string& line : unit_hints(mesh, 1.0)) lines.push_back(line);
  const MeshDefect crossing = models::crossing_faces(mesh);
  add(lines, crossing, "pair of faces that cross or lie on one another",
      crossing.count < models::kMostCrossings ? "pairs of faces that cross or lie on one another"
                                              : "or more pairs of faces that cross or lie on one another");
  return lines;
}

bool is_a_body(const LoadedMesh& loaded) {
  return models::why_no_inside(*loaded.mesh, loaded.account.closing).what.empty();
}

std::vector<std::string> mesh_surprises(const models::TriangleMesh& mesh, double reach_m, double scale) {
  // A mesh in millimetres is a thousand times too large. Objects that an arm touches are between a tenth of its reach
  // and a few times its reach in size. So a mesh of 30 times the reach, or of a 3000th of it, is in the wrong unit.
  constexpr double too_large = 30.0, too_small = 1.0 / 3000.0;
  // As a share of the mesh's diagonal. Larger holes are visible; the border of a sheet has about 1.
  constexpr double hardly_seen = 0.1;
  std::vector<std::string> lines;
  const double diagonal = (mesh.bounds().high - mesh.bounds().low).norm();
  if (diagonal > too_large * reach_m || diagonal < too_small * reach_m) {
    const double factor = diagonal > reach_m ? 1e-3 : 1e3;
    lines.push_back("it is " + size_text(diagonal) + " across, and the arm reaches " + size_text(reach_m) +
                    ": if its unit isn't the one of scale_m " + description::number_text(scale) +
                    ", write scale_m: " + description::number_text(scale * factor));
  }
  if (mesh.closed()) return lines;
  // A crack may be as narrow as the rounding of coordinates if a file repeats a vertex. An example is the pole of a
  // sphere, if a script computed it for each triangle separately. A proxy doesn't fall through such a crack, because no
  // coordinates lie within it.
  const double largest_m = mesh.bounds().low.cwiseAbs().cwiseMax(mesh.bounds().high.cwiseAbs()).maxCoeff();
  std::vector<MeshHole> holes = models::topology_of(mesh).holes;
  std::erase_if(holes, [&](const MeshHole& hole) {
    return hole.size_m < 2.0 * std::numeric_limits<double>::epsilon() * largest_m;
  });
  const auto small = static_cast<std::size_t>(std::count_if(
      holes.begin(), holes.end(), [&](const MeshHole& hole) { return hole.size_m < hardly_seen * diagonal; }));
  if (small > 0) {
    lines.push_back("the proxy, a point, falls through " + counted(small, "small hole", "small holes") + ": " +
                    holes_text(holes, small) + " (close_holes_m closes them)");
  }
  return lines;
}

}  // namespace proxarm::scenes
