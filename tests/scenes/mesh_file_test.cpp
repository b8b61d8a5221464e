// Meshes from files, and scenes with them.
#include "scenes/mesh_file.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>
#include <fstream>

#include "models/description/setup_error.hpp"
#include "models/mesh_surface.hpp"
#include "scenes/compile.hpp"
#include "scenes/scene_file.hpp"
#include "tests/models/mesh_shapes.hpp"
#include "tests/models/random_states.hpp"

namespace proxarm::tests {
namespace {

using description::SetupError;
using models::TriangleMesh;
using models::TriangleSoup;
using models::Vec3;
using scenes::CompiledScene;
using scenes::Scene;

class MeshFile : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() /
              (std::string("proxarm_mesh_") + testing::UnitTest::GetInstance()->current_test_info()->name());
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name, std::ios::binary) << text;
    return folder_ / name;
  }
  Scene scene(const std::string& text) const { return scenes::parse_scene(text, folder_ / "scene.yaml"); }

  std::filesystem::path folder_;
};

// Binary STL as its description has it: 80 bytes, a count, and 50 bytes a triangle, little-endian.
std::string stl_of(const TriangleSoup& soup) {
  std::string out(80, ' ');
  const auto put = [&out](const auto& value) {
    char bytes[sizeof(value)];
    std::memcpy(bytes, &value, sizeof(value));
    out.append(bytes, sizeof(value));
  };
  put(static_cast<std::uint32_t>(soup.triangles.size()));
  for (const auto& t : soup.triangles) {
    for (int k = 0; k < 3; ++k) put(0.0f);
    for (const auto v : t) {
      for (const double x : soup.vertices[v]) put(static_cast<float>(x));
    }
    put(std::uint16_t{0});
  }
  return out;
}

std::string obj_of(const TriangleSoup& soup) {
  std::string out;
  for (const Vec3& v : soup.vertices) {
    out += "v " + std::to_string(v.x()) + " " + std::to_string(v.y()) + " " + std::to_string(v.z()) + "\n";
  }
  for (const auto& [a, b, c] : soup.triangles) {
    out += "f " + std::to_string(a + 1) + " " + std::to_string(b + 1) + " " + std::to_string(c + 1) + "\n";
  }
  return out;
}

std::string ply_of(const TriangleSoup& soup) {
  std::string out = "ply\nformat ascii 1.0\nelement vertex " + std::to_string(soup.vertices.size()) +
                    "\nproperty float x\nproperty float y\nproperty float z\nelement face " +
                    std::to_string(soup.triangles.size()) + "\nproperty list uchar int vertex_indices\nend_header\n";
  for (const Vec3& v : soup.vertices) {
    out += std::to_string(v.x()) + " " + std::to_string(v.y()) + " " + std::to_string(v.z()) + "\n";
  }
  for (const auto& [a, b, c] : soup.triangles) {
    out += "3 " + std::to_string(a) + " " + std::to_string(b) + " " + std::to_string(c) + "\n";
  }
  return out;
}

TEST_F(MeshFile, ReadsStlObjAndPlyWeldedAndClosed) {
  const TriangleSoup soup = block({1, 2, 3});
  for (const auto& file : {write("a.stl", stl_of(soup)), write("b.OBJ", obj_of(soup)), write("c.ply", ply_of(soup))}) {
    const auto mesh = scenes::load_mesh(file, 1.0, models::Pose::Identity());
    EXPECT_EQ(mesh->size(), 12u) << file;
    EXPECT_TRUE(mesh->closed()) << file;
    EXPECT_EQ(mesh->bounds().high, Vec3(0.5, 1, 1.5)) << file;
    EXPECT_TRUE(mesh->encloses({0.4, 0.9, 1.4})) << file;
    EXPECT_FALSE(mesh->encloses({0.4, 0.9, 1.6})) << file;
  }
}

TEST_F(MeshFile, SaysWhatIsWrong) {
  const auto expect = [&](const std::filesystem::path& file, const std::string& part) {
    try {
      (void)scenes::load_mesh(file, 1.0, models::Pose::Identity());
      ADD_FAILURE() << file << " was read";
    } catch (const SetupError& error) {
      EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
      EXPECT_EQ(error.file(), file.string());
    }
  };
  expect(folder_ / "none.stl", "no such file");
  expect(write("a.txt", "solid"), ".stl, .obj or .ply");
  expect(write("empty.stl", ""), "a mesh");
  expect(write("text.obj", "this is no mesh\n"), "a mesh");
  expect(write("half.stl", stl_of(block({1, 1, 1})).substr(0, 300)), "a mesh");
  expect(write("beyond.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n"), "");
  expect(write("flat.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n"), "");
  expect(write("points.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n"), "a mesh");
}

TEST_F(MeshFile, IsRenderedAsTheBoxThatItIs) {
  write("block.stl", stl_of(block({1, 1, 1})));
  const Scene alone =
      scene("objects:\n  - mesh: {file: block.stl, scale_m: 0.5, position_m: [0, 0, 1], friction: 0.3}\n");
  const CompiledScene world = scenes::compile(alone);
  auto& g = world.algorithm<3>();
  EXPECT_NE(dynamic_cast<models::MeshSurface*>(&g), nullptr) << "without a world around it";
  const Vec3 r = g(1e6, {0.1, 0.1, 1.24}, {0.1, 0.1, 1.5});
  EXPECT_LE((r - Vec3(0.1, 0.1, 1.25)).norm(), 1e-12);
  ASSERT_EQ(g.contacts().size(), 1u);
  EXPECT_NEAR(scenes::clearance_m(alone, {0, 0, 1.5}), 0.25, 1e-15);
  EXPECT_NEAR(scenes::clearance_m(alone, {0, 0, 1.2}), -0.05, 1e-15);
}

// A floor and a block that stands on it: held by each, and in the groove between them.
TEST_F(MeshFile, JoinsOtherObjects) {
  write("block.stl", stl_of(block({1, 1, 1})));
  const Scene both = scene(
      "objects:\n  - mesh: {file: block.stl, friction: 0.3}\n  - plane: {point_m: [0, 0, 0], normal: [0, 0, 1], "
      "friction: 0.2}\n");
  const CompiledScene world = scenes::compile(both);
  auto& g = world.algorithm<3>();
  Vec3 q(1, 0.1, 0.2);
  q = g(1e6, {1, 0.1, -0.1}, q);
  EXPECT_LE((q - Vec3(1, 0.1, 0)).norm(), 1e-12);
  EXPECT_EQ(g.contacts()[0].object, 1);
  q = g(1e6, {0.4, 0.1, 0.3}, {1, 0.1, 0.3});
  EXPECT_LE((q - Vec3(0.5, 0.1, 0.3)).norm(), 1e-12);
  EXPECT_EQ(g.contacts()[0].object, 0);
  q = Vec3(0.6, 0.1, 0.1);
  for (int k = 0; k < 10; ++k) q = g(1e6, q + Vec3(-0.05, 0, -0.05), q);
  EXPECT_LE((q - Vec3(0.5, 0.1, 0)).norm(), 1e-12);
  EXPECT_EQ(g.contacts().size(), 2u);
  EXPECT_EQ(g(1e6, {3, 0, 1}, {2, 0, 1}), Vec3(3, 0, 1));
}

// A mesh holds from both sides, so a world that let the proxy an ulp behind a face would let it through.
TEST_F(MeshFile, LetsNothingThroughBesideOtherObjects) {
  write("block.stl", stl_of(block({1, 1, 1})));
  const CompiledScene world = scenes::compile(scene(
      "objects:\n  - mesh: {file: block.stl, friction: 0.3}\n  - plane: {point_m: [0, 0, 0], normal: [0.1, 0, 1], "
      "friction: 0.2}\n  - sphere: {centre_m: [0.5, 0, 0.5], radius_m: 0.2}\n"));
  auto& g = world.algorithm<3>();
  Random random(901);
  const Vec3 start(0.9, 0.1, 0.3);
  Vec3 q = start;
  for (std::int64_t i = 0; i < scaled(50'000); ++i) {
    const double step = random.log_uniform(1e-9, 1.0);
    // Round numbers, which end in faces, edges and grooves exactly or an ulp off.
    Vec3 p = q + step * random.direction<3>();
    if (random.chance(0.5)) p = (20.0 * p).array().round() / 20.0;
    const Vec3 r = g(1e6, p, q);
    ASSERT_GT(r.cwiseAbs().maxCoeff(), 0.5) << "step " << i << " from " << q.transpose() << " to " << p.transpose();
    ASSERT_GE(Vec3(0.1, 0, 1).dot(r), -1e-12) << "step " << i;
    ASSERT_GE((r - Vec3(0.5, 0, 0.5)).norm(), 0.2 - 1e-12) << "step " << i;
    q = r.norm() > 2.0 ? start : r;
  }
  std::cout << "  unresolved " << g.unresolved_steps() << "\n";
}

TEST_F(MeshFile, RefusesInScenesWhatAMeshCannot) {
  write("block.stl", stl_of(block({1, 1, 1})));
  TriangleSoup open = block({1, 1, 1});
  open.triangles.pop_back();
  write("open.stl", stl_of(open));
  for (const char* text : {
           "objects:\n  - mesh: {file: other.stl}\n",
           "objects:\n  - mesh: {}\n",
           "objects:\n  - mesh: {file: block.stl, scale_m: 0}\n",
           "objects:\n  - mesh: {file: block.stl, friction: -1}\n",
           "objects:\n  - mesh: {file: block.stl, size_m: [1, 1, 1]}\n",
           "objects:\n  - mesh: {file: open.stl, inside_out: true}\n",
           "objects:\n  - mesh: {file: block.stl, motion: {velocity_m_per_s: [1, 0, 0]}}\n",
           "objects:\n  - mesh: {file: block.stl, layer: {thickness_m: 0.01, stiffness_N_per_m: 100}}\n",
           "media:\n  - viscous: {damping_Ns_per_m: 1, within: {mesh: {file: block.stl}}}\n",
           "dimensions: 1\nspace: {axes: [[1, 0, 0]]}\nobjects:\n  - mesh: {file: block.stl}\n",
       }) {
    EXPECT_THROW(scenes::compile(scene(text)), SetupError) << text;
  }
  EXPECT_NO_THROW(scenes::compile(scene("objects:\n  - mesh: {file: open.stl}\n")));
  EXPECT_NO_THROW(scenes::compile(scene("objects:\n  - mesh: {file: block.stl, inside_out: true}\n")));
}

}  // namespace
}  // namespace proxarm::tests
