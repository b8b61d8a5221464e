#include "scenes/mesh_files/mesh_builder.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <stdexcept>

#include "models/mesh/mesh_predicates.hpp"
#include "models/mesh/polygon.hpp"

namespace proxarm::scenes {

using models::TriangleSoup;
using models::Vec3;

void MeshBuilder::reserve(std::size_t vertices, std::size_t faces) {
  mesh_.soup.vertices.reserve(vertices);
  mesh_.soup.triangles.reserve(faces);
}

bool MeshBuilder::add_vertex(double x, double y, double z) {
  mesh_.soup.vertices.emplace_back(x, y, z);
  return std::isfinite(x) && std::isfinite(y) && std::isfinite(z);
}

void MeshBuilder::note_written(std::string_view number) noexcept {
  const std::size_t e = number.find_first_of("eE");
  const std::string_view mantissa = number.substr(0, e);
  const std::size_t point = mantissa.find('.');
  const auto places = static_cast<int>(point == std::string_view::npos ? 0 : mantissa.size() - point - 1);
  int exponent = 0;
  if (e != std::string_view::npos) {
    std::string_view digits = number.substr(e + 1);
    if (digits.starts_with('+')) digits.remove_prefix(1);
    std::from_chars(digits.data(), digits.data() + digits.size(), exponent);
  }
  const double digit = std::pow(10.0, std::clamp(exponent, -400, 400) - std::min(places, 400));
  if (mesh_.last_digit == 0.0 || digit < mesh_.last_digit) mesh_.last_digit = digit;
}

// Adds a face to face_ and merges equal neighbouring corners. Precondition: no corner is negative.
void MeshBuilder::take(std::span<const std::int64_t> corners) {
  ++mesh_.account.faces;
  face_.clear();
  for (const std::int64_t corner : corners) {
    if (face_.empty() || face_.back() != corner) face_.push_back(corner);
  }
  while (face_.size() > 1 && face_.front() == face_.back()) face_.pop_back();
  if (face_.size() < 3 || (face_.size() == 4 && (face_[0] == face_[2] || face_[1] == face_[3]))) {
    ++mesh_.account.unfit;
    return;
  }
  if (face_.size() == 3) {
    auto& triangle = mesh_.soup.triangles.emplace_back();
    for (std::size_t k = 0; k < 3; ++k) triangle[k] = static_cast<std::uint32_t>(face_[k]);
    return;
  }
  ++mesh_.account.polygons;
  for (const std::int64_t corner : face_) corners_.push_back(static_cast<std::uint32_t>(corner));
  ends_.push_back(corners_.size());
}

void MeshBuilder::add_face(std::span<const std::int64_t> corners) {
  for (const std::int64_t corner : corners) {
    if (corner < 0 || corner >= (std::int64_t{1} << 31)) {
      throw std::runtime_error("face " + std::to_string(mesh_.account.faces) + " has vertex " + std::to_string(corner));
    }
  }
  take(corners);
}

void MeshBuilder::add_strip(std::span<const std::int64_t> corners) {
  std::size_t begin = 0;
  for (std::size_t k = 0; k < corners.size(); ++k) {
    if (corners[k] == -1) {
      begin = k + 1;
      continue;
    }
    if (k < begin + 2) continue;
    std::int64_t turned[] = {corners[k - 2], corners[k - 1], corners[k]};
    if ((k - begin) % 2 == 1) std::swap(turned[0], turned[1]);
    add_face(turned);
    ++mesh_.account.strip_faces;
  }
}

ParsedMesh MeshBuilder::finish() {
  TriangleSoup& soup = mesh_.soup;
  FaceAccount& account = mesh_.account;
  account.vertices = soup.vertices.size();
  std::vector<bool> used(soup.vertices.size(), false);
  const auto use = [&](std::uint32_t corner) {
    if (corner >= used.size()) {
      throw std::runtime_error("a face has vertex " + std::to_string(corner) + " (counted from 0) of " +
                               std::to_string(used.size()));
    }
    used[corner] = true;
  };
  for (const auto& triangle : soup.triangles) std::for_each(triangle.begin(), triangle.end(), use);
  std::for_each(corners_.begin(), corners_.end(), use);
  std::size_t begin = 0;
  for (const std::size_t end : ends_) {
    const std::span polygon = std::span(corners_).subspan(begin, end - begin);
    if (!models::triangulate(soup.vertices, polygon, soup.triangles)) ++account.crossing;
    begin = end;
  }
  account.unused_vertices = static_cast<std::uint64_t>(std::count(used.begin(), used.end(), false));
  if (soup.triangles.empty()) throw std::runtime_error(account.faces == 0 ? "no faces" : "no face with an area");
  return std::move(mesh_);
}

}  // namespace proxarm::scenes
