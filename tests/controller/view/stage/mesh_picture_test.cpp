#include "controller/stage/mesh_picture.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <numbers>

namespace proxarm::view {
namespace {

using models::Vec3;
using Corners = std::array<std::uint32_t, 3>;

struct Ball {
  std::vector<Vec3> vertices;
  std::vector<Corners> triangles;
};

// Of radius 1, in so many rows of twice as many columns; triangles turn outwards.
Ball ball(std::uint32_t rows) {
  Ball out;
  const std::uint32_t columns = 2 * rows;
  for (std::uint32_t i = 0; i <= rows; ++i) {
    for (std::uint32_t j = 0; j < columns; ++j) {
      const double polar = std::numbers::pi * i / rows, around = std::numbers::pi * j / rows;
      out.vertices.emplace_back(std::sin(polar) * std::cos(around), std::sin(polar) * std::sin(around),
                                std::cos(polar));
    }
  }
  for (std::uint32_t i = 0; i < rows; ++i) {
    for (std::uint32_t j = 0; j < columns; ++j) {
      const std::uint32_t a = i * columns + j, b = i * columns + (j + 1) % columns;
      out.triangles.push_back({a, a + columns, b + columns});
      out.triangles.push_back({a, b + columns, b});
    }
  }
  return out;
}

struct Picture {
  std::vector<float> numbers;
  std::vector<Corners> triangles;
  [[nodiscard]] Vec3 vertex(std::uint32_t i) const {
    return {numbers.at(3 * i), numbers.at(3 * i + 1), numbers.at(3 * i + 2)};
  }
};

Picture read(const std::string& bytes) {
  std::array<std::uint32_t, 2> counts{};
  std::memcpy(counts.data(), bytes.data(), sizeof counts);
  Picture out{std::vector<float>(3 * counts[0]), std::vector<Corners>(counts[1])};
  EXPECT_EQ(bytes.size(), 8 + 12 * (out.numbers.size() / 3 + out.triangles.size()));
  std::memcpy(out.numbers.data(), bytes.data() + 8, 4 * out.numbers.size());
  std::memcpy(out.triangles.data(), bytes.data() + 8 + 4 * out.numbers.size(), 12 * out.triangles.size());
  return out;
}

TEST(MeshPicture, SmallMeshesStayAsTheyAreButForTheirScale) {
  const Ball small = ball(20);
  const Picture picture = read(mesh_picture(small.vertices, small.triangles, {1.0, 2.0, 3.0}));
  EXPECT_EQ(picture.triangles, small.triangles);
  const Vec3 expected = small.vertices[77].cwiseProduct(Vec3(1.0, 2.0, 3.0));
  EXPECT_LT((picture.vertex(77) - expected).norm(), 1e-6);  // m: what single precision keeps of 3
}

TEST(MeshPicture, LargeMeshesBecomeCoarserAndKeepTheirShape) {
  const Ball large = ball(286);
  ASSERT_GT(large.triangles.size(), 327'000U);
  const Picture picture = read(mesh_picture(large.vertices, large.triangles, Vec3::Ones()));
  EXPECT_LE(picture.triangles.size(), most_triangles);
  EXPECT_GT(picture.triangles.size(), most_triangles / 3);
  double twice = 0.0;
  for (const Corners& t : picture.triangles) {
    const Vec3 a = picture.vertex(t[0]), b = picture.vertex(t[1]), c = picture.vertex(t[2]);
    const Vec3 normal = (b - a).cross(c - a);
    twice += normal.norm();
    // Cubes of a 45th of the radius: a mean of what is within one lies at most a diagonal off the surface.
    EXPECT_NEAR(a.norm(), 1.0, 0.04);
    EXPECT_GE(normal.dot(a), -1e-6) << "a triangle looks inwards";
  }
  EXPECT_NEAR(0.5 * twice, 4.0 * std::numbers::pi, 0.1 * 4.0 * std::numbers::pi) << "there are holes";
}

TEST(MeshPicture, AFlatAndARuggedOneAreMadeCoarserToo) {
  Ball large = ball(286);
  for (std::size_t i = 0; i < large.vertices.size(); ++i) {
    const double noise = static_cast<double>((i * 2654435761U) % 1000) / 1000.0;
    large.vertices[i] *= 0.2 + noise;
  }
  EXPECT_LE(read(mesh_picture(large.vertices, large.triangles, Vec3::Ones())).triangles.size(), most_triangles);
  for (Vec3& v : large.vertices) v.z() = 0.0;
  const Picture flat = read(mesh_picture(large.vertices, large.triangles, Vec3::Ones()));
  EXPECT_LE(flat.triangles.size(), most_triangles);
  EXPECT_FALSE(flat.triangles.empty());
}

}  // namespace
}  // namespace proxarm::view
