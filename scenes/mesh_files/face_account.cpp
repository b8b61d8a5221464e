#include "scenes/mesh_files/face_account.hpp"

#include <cstdio>

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
  add(text, closing, "%llu triangles added over holes");
  return text;
}

}  // namespace proxarm::scenes
