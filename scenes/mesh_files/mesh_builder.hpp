// Gathers the vertices and faces that a mesh file has, whatever its format, and counts them.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "scenes/mesh_files/face_account.hpp"

namespace proxarm::scenes {

// Readers call these in the file's order. What is wrong is told by std::runtime_error.
class MeshBuilder {
 public:
  void reserve(std::size_t vertices, std::size_t faces);
  // False for a coordinate that isn't finite.
  [[nodiscard]] bool add_vertex(double x, double y, double z);
  // A coordinate as a text file writes it: its last digit says how the file rounds.
  void note_written(std::string_view number) noexcept;
  [[nodiscard]] std::size_t vertices() const noexcept { return mesh_.soup.vertices.size(); }

  // A polygon by its corners, which may be vertices that are still to come. Neighbours that are the same count once.
  void add_face(std::span<const std::int64_t> corners);
  // A strip: each corner makes a triangle with the two before it, every other one turned; −1 begins another strip.
  void add_strip(std::span<const std::int64_t> corners);
  void add_points_and_lines(std::uint64_t count) noexcept { mesh_.account.points_and_lines += count; }
  void add_bytes_behind(std::uint64_t count) noexcept { mesh_.account.bytes_behind += count; }
  [[nodiscard]] const FaceAccount& account() const noexcept { return mesh_.account; }

  // Splits polygons and holds all corners against the vertices. Throws for one that there isn't, and without triangles.
  ParsedMesh finish();

 private:
  void take(std::span<const std::int64_t> corners);

  ParsedMesh mesh_;
  std::vector<std::uint32_t> corners_;  // of all polygons
  std::vector<std::size_t> ends_;       // where each ends in corners_
  std::vector<std::int64_t> face_;      // the one at hand
};

}  // namespace proxarm::scenes
