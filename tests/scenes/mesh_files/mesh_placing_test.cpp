// What load_mesh() makes of a file beyond its triangles: welded corners, faces that are there once, and a place.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <string>
#include <utility>

#include "models/base/random.hpp"
#include "scenes/mesh_files/mesh_file.hpp"
#include "scenes/mesh_files/mesh_report.hpp"
#include "tests/models/mesh/mesh_shapes.hpp"
#include "tests/scenes/mesh_files/mesh_folder.hpp"

namespace proxarm::tests {
namespace {

using models::Random;
using models::TriangleSoup;
using models::Vec3;
using scenes::MeshPlacement;

// Each triangle with corners of its own, each coordinate off by up to `by`.
TriangleSoup torn(const TriangleSoup& soup, double by, std::uint64_t seed) {
  Random random(seed);
  TriangleSoup out;
  for (const auto& t : soup.triangles) {
    const auto first = static_cast<std::uint32_t>(out.vertices.size());
    for (const std::uint32_t v : t) out.vertices.push_back(soup.vertices[v] + random.in_box<3>(by));
    out.triangles.push_back({first, first + 1, first + 2});
  }
  return out;
}

std::string obj_of(const TriangleSoup& soup, const char* format) {
  std::string text;
  for (const Vec3& x : soup.vertices) {
    char line[128];
    std::snprintf(line, sizeof line, format, x.x(), x.y(), x.z());
    text += line;
  }
  for (const auto& t : soup.triangles) {
    text += "f " + std::to_string(t[0] + 1) + " " + std::to_string(t[1] + 1) + " " + std::to_string(t[2] + 1) + "\n";
  }
  return text;
}

class MeshWelding : public MeshFolder {};

TEST_F(MeshWelding, ClosesWhatTheFilesRoundingTearsAndTellsIt) {
  const auto stl = write("torn.stl", stl_of(torn(block({0.2, 0.2, 0.2}), 1e-7, 1)));
  const scenes::LoadedMesh loaded = scenes::load_mesh(stl, {});
  EXPECT_TRUE(loaded.mesh->closed());
  EXPECT_EQ(loaded.account.welded, 28u);
  EXPECT_THAT(scenes::mesh_report(loaded).at(0), testing::HasSubstr("28 corners welded within 1.53 µm, moved by 0."));
  EXPECT_FALSE(scenes::load_mesh(stl, {.weld_m = 0.0}).mesh->closed()) << "0 turns it off";
  EXPECT_FALSE(scenes::load_mesh(stl, {.weld_m = 1e-8}).mesh->closed());
  EXPECT_TRUE(scenes::load_mesh(stl, {.scale = 0.01}).mesh->closed()) << "the tolerance is the file's";
}

TEST_F(MeshWelding, TakesTheLastWrittenDigitOfATextFile) {
  const TriangleSoup soup = torn(ball(2, 1.0), 4e-5, 2);
  EXPECT_TRUE(scenes::load_mesh(write("rounded.obj", obj_of(soup, "v %.4f %.4f %.4f\n")), {}).mesh->closed());
  EXPECT_TRUE(scenes::load_mesh(write("powers.obj", obj_of(soup, "v %.4e %.4e %.4e\n")), {}).account.welded < 480u)
      << "its last digit is that of its smallest number";
  EXPECT_FALSE(scenes::load_mesh(write("exact.obj", obj_of(soup, "v %.9f %.9f %.9f\n")), {}).mesh->closed());
}

TEST_F(MeshWelding, OfACachedMeshIsThatOfItsTolerance) {
  const auto file = write("torn.stl", stl_of(torn(ball(5, 0.5), 1e-7, 3)));
  for (int k = 0; k < 2; ++k) {
    const scenes::LoadedMesh welded = scenes::load_mesh(file, {}), again = scenes::load_mesh(file, {});
    EXPECT_TRUE(welded.mesh->closed() && again.mesh->closed());
    EXPECT_EQ(again.account.text(), welded.account.text());
    EXPECT_FALSE(scenes::load_mesh(file, {.weld_m = 0.0}).mesh->closed());
  }
}

TEST_F(MeshWelding, LeavesFacesThatAreThereTwiceOut) {
  TriangleSoup soup = ball(2, 0.1);
  join(soup, ball(2, 0.1));
  const scenes::LoadedMesh loaded = scenes::load_mesh(write("dup.stl", stl_of(soup)), {});
  EXPECT_EQ(loaded.mesh->size(), 320u);
  EXPECT_EQ(loaded.account.repeated, 320u);
  EXPECT_TRUE(loaded.mesh->encloses(Vec3::Zero()));
  EXPECT_TRUE(scenes::is_a_body(loaded));
}

class MeshPlacing : public MeshFolder {};

TEST_F(MeshPlacing, PutsTheOriginTheCentreOrTheBottomOfItsBoxAtThePosition) {
  TriangleSoup soup = block({0.2, 0.1, 0.4});
  for (Vec3& x : soup.vertices) x += Vec3(3.0, -2.0, 1.0);
  soup.vertices.emplace_back(50.0, 50.0, 50.0);  // that no face uses
  const auto file = write("far.obj", obj_of(soup, "v %.17g %.17g %.17g\n"));
  MeshPlacement at;
  at.pose_W.translation() = Vec3(0.7, 0.1, 0.3);
  at.scale = 0.5;
  constexpr double rounding_m = 1e-14;  // coordinates of some metres, turned and moved
  at.pose_W.linear() = Eigen::AngleAxisd(0.3, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  at.anchor = MeshPlacement::Anchor::centre;
  models::Bounds box = scenes::load_mesh(file, at).mesh->bounds();
  EXPECT_LT((0.5 * (box.low + box.high) - at.pose_W.translation()).norm(), rounding_m);
  at.anchor = MeshPlacement::Anchor::low;
  box = scenes::load_mesh(file, at).mesh->bounds();
  EXPECT_NEAR(box.low.z(), 0.3, rounding_m);
  EXPECT_LT((0.5 * (box.low + box.high) - at.pose_W.translation()).head<2>().norm(), rounding_m);
  at.anchor = MeshPlacement::Anchor::origin;
  box = scenes::load_mesh(file, at).mesh->bounds();
  const Vec3 middle = at.pose_W * Vec3(0.5 * Vec3(3.0, -2.0, 1.0));
  EXPECT_LT((0.5 * (box.low + box.high) - middle).norm(), rounding_m);
}

TEST_F(MeshPlacing, HasItsUnitDoubtedAtTwoHundredMetresAndATenthOfAMillimetre) {
  const auto hints = [&](double size, double scale) {
    return scenes::unit_hints(*scenes::load_mesh(write("part.stl", stl_of(block(Vec3::Constant(size)))), {}).mesh,
                              scale);
  };
  EXPECT_THAT(hints(200.0, 1.0).at(0), testing::HasSubstr("looks like mm; write scale_m: 0.001"));
  EXPECT_THAT(hints(0.1e-3, 0.001).at(0), testing::HasSubstr("write scale_m: 1"));
  EXPECT_TRUE(hints(199.0, 1.0).empty());
  EXPECT_TRUE(hints(0.3e-3, 1.0).empty());
}

}  // namespace
}  // namespace proxarm::tests
