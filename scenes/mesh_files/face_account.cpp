#include "scenes/mesh_files/face_account.hpp"

#include <cstdio>

#include "models/mesh/mesh_topology.hpp"

namespace proxarm::scenes {
namespace {

void add(std::string& text, std::uint64_t count, const char* what) {
  if (count == 0) return;
  char part[160];
  std::snprintf(part, sizeof part, what, static_cast<unsigned long long>(count));
  text += (text.empty() ? "" : ", ") + std::string(part);
}

}  // namespace

std::string FaceAccount::text() const {
  std::string text;
  add(text, vertices, "%llu vertices");
  add(text, faces, "%llu faces");
  add(text, polygons, "%llu of them polygons, split into triangles");
  add(text, strip_faces, "%llu of them out of strips");
  add(text, crossing, "%llu polygons that cross themselves, split as fans");
  add(text, unfit, "%llu faces left out that name a vertex twice (no area)");
  add(text, flat, "%llu triangles left out whose corners are on a line (no area)");
  add(text, unused_vertices, "%llu vertices that no face uses");
  add(text, points_and_lines, "%llu points and lines left out");
  add(text, bytes_behind, "%llu bytes behind the last face left out");
  add(text, repeated, "%llu faces left out that are there already");
  add(text, double_sided, "%llu faces left out that are there already with the opposite front (double-sided)");
  if (welded > 0) {
    text += ", " + std::to_string(welded) + (welded == 1 ? " corner" : " corners") + " welded within " +
            models::size_text(welded_within_m) + ", moved by " + models::size_text(welded_apart_m) + " at most";
  }
  add(text, collapsed, "%llu triangles left out that were smaller than that");
  add(text, closing, "%llu triangles added over holes");
  return text;
}

}  // namespace proxarm::scenes
