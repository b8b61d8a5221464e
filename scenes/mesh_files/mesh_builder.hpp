// Collects and counts the vertices and faces of a mesh file of any format.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "scenes/mesh_files/face_account.hpp"

namespace proxarm::scenes {

// Call in the file's order. Errors are std::runtime_error.
class MeshBuilder {
 public:
  void reserve(std::size_t vertices, std::size_t faces);
  // False for a coordinate that isn't finite.
  [[nodiscard]] bool add_vertex(double x, double y, double z);
  // Gives a coordinate as written in a text file; its last digit shows how the file rounds.
  void note_written(std::string_view number) noexcept;
  [[nodiscard]] std::size_t vertices() const noexcept { return mesh_.soup.vertices.size(); }

  // Adds a polygon by its corners, which may be vertices that follow later. Equal neighbours count once.
  void add_face(std::span<const std::int64_t> corners);
  // Adds a strip: each corner forms a triangle with the two before it, with alternating orientation; −1 begins another
  // strip.
  void add_strip(std::span<const std::int64_t> corners);
  void add_points_and_lines(std::uint64_t count) noexcept { mesh_.account.points_and_lines += count; }
  void add_bytes_behind(std::uint64_t count) noexcept { mesh_.account.bytes_behind += count; }
  [[nodiscard]] const FaceAccount& account() const noexcept { return mesh_.account; }

  // Splits polygons and checks all corners. Throws for a missing vertex, and if there are no triangles.
  ParsedMesh finish();

 private:
  void take(std::span<const std::int64_t> corners);

  ParsedMesh mesh_;
  std::vector<std::uint32_t> corners_;  // of all polygons
  std::vector<std::size_t> ends_;       // where each ends in corners_
  std::vector<std::int64_t> face_;      // the current face
};

}  // namespace proxarm::scenes
