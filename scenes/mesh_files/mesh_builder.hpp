// Collects and counts the vertices and faces of a mesh file of any format.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "scenes/mesh_files/face_account.hpp"

namespace proxarm::scenes {

// The functions must be called in the order of the file. They report errors as std::runtime_error.
class MeshBuilder {
 public:
  void reserve(std::size_t vertices, std::size_t faces);
  // Adds a vertex. False if a coordinate isn't finite.
  [[nodiscard]] bool add_vertex(double x, double y, double z);
  // Gets a coordinate as it is written in a text file. Its last digit shows how the file rounds.
  void note_written(std::string_view number) noexcept;
  [[nodiscard]] std::size_t vertices() const noexcept { return mesh_.soup.vertices.size(); }

  // Adds a polygon by its corners, which may be vertices that are added later. Equal neighbouring corners count once.
  void add_face(std::span<const std::int64_t> corners);
  // Adds a strip: each corner forms a triangle with the two corners before it, with alternating orientation. The value
  // −1 begins another strip.
  void add_strip(std::span<const std::int64_t> corners);
  void add_points_and_lines(std::uint64_t count) noexcept { mesh_.account.points_and_lines += count; }
  void add_bytes_behind(std::uint64_t count) noexcept { mesh_.account.bytes_behind += count; }
  [[nodiscard]] const FaceAccount& account() const noexcept { return mesh_.account; }

  // Splits polygons into triangles and checks all corners. Throws if a vertex is missing or if there are no triangles.
  ParsedMesh finish();

 private:
  void take(std::span<const std::int64_t> corners);

  ParsedMesh mesh_;
  std::vector<std::uint32_t> corners_;  // corners of all polygons
  std::vector<std::size_t> ends_;       // where each polygon ends in corners_
  std::vector<std::int64_t> face_;      // corners of the current face
};

}  // namespace proxarm::scenes
