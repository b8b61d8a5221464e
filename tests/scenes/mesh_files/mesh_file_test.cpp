// Meshes from files, and scenes with them.
#include "scenes/mesh_files/mesh_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "models/base/setup_error.hpp"
#include "models/mesh/mesh_surface.hpp"
#include "scenes/compiler/clearances.hpp"
#include "scenes/compiler/compile.hpp"
#include "scenes/format/scene_file.hpp"
#include "tests/models/mesh/mesh_shapes.hpp"
#include "tests/models/surfaces/random_states.hpp"
#include "tests/scenes/mesh_files/mesh_folder.hpp"
#include "tests/source_file.hpp"

namespace proxarm::tests {
namespace {

using description::SetupError;
using models::TriangleSoup;
using models::Vec3;
using scenes::CompiledScene;
using scenes::Scene;

class MeshFile : public MeshFolder {
 protected:
  Scene scene(const std::string& text) const { return scenes::parse_scene(text, folder / "scene.yaml"); }
};

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

std::string text_stl_of(const TriangleSoup& soup) {
  std::string out = "solid some\n";
  for (const auto& triangle : soup.triangles) {
    out += "facet normal 0 0 0\nouter loop\n";
    for (const std::uint32_t v : triangle) {
      const Vec3& x = soup.vertices[v];
      out += "vertex " + std::to_string(x.x()) + " " + std::to_string(x.y()) + " " + std::to_string(x.z()) + "\n";
    }
    out += "endloop\nendfacet\n";
  }
  return out + "endsolid some\n";
}

std::string binary_ply_of(const TriangleSoup& soup) {
  std::string out = "ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(soup.vertices.size()) +
                    "\nproperty float x\nproperty float y\nproperty float z\nelement face " +
                    std::to_string(soup.triangles.size()) + "\nproperty list uchar int vertex_indices\nend_header\n";
  const auto add = [&](const auto& value) {
    char bytes[sizeof value];
    std::memcpy(bytes, &value, sizeof value);
    out.append(bytes, sizeof value);
  };
  for (const Vec3& v : soup.vertices) {
    for (int k = 0; k < 3; ++k) add(static_cast<float>(v[k]));
  }
  for (const auto& triangle : soup.triangles) {
    add(static_cast<std::uint8_t>(3));
    for (const std::uint32_t v : triangle) add(v);
  }
  return out;
}

TEST_F(MeshFile, ReadsStlObjAndPlyWeldedAndClosed) {
  const TriangleSoup soup = block({1, 2, 3});
  for (const auto& file : {write("a.stl", stl_of(soup)), write("b.OBJ", obj_of(soup)), write("c.ply", ply_of(soup)),
                           write("d.stl", text_stl_of(soup)), write("e.ply", binary_ply_of(soup))}) {
    const auto mesh = scenes::load_mesh(file, {1.0, models::Pose::Identity()}).mesh;
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
      (void)scenes::load_mesh(file, {1.0, models::Pose::Identity()}).mesh;
      ADD_FAILURE() << file << " was read";
    } catch (const SetupError& error) {
      EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
      EXPECT_EQ(error.file(), file.string());
    }
  };
  expect(folder / "none.stl", "no such file");
  expect(write("a.txt", "solid"), ".stl, .obj or .ply");
  expect(write("empty.stl", ""), "a mesh");
  expect(write("text.obj", "this is no mesh\n"), "a mesh");
  expect(write("half.stl", stl_of(block({1, 1, 1})).substr(0, 300)), "a mesh");
  expect(write("beyond.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n"), "");
  expect(write("flat.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n"), "");
  // Two that make assimp end the program: a face that has no corners, a corner that is no number.
  const std::string ply = ply_of(block({1, 1, 1}));
  expect(write("cut.ply", ply.substr(0, ply.find("end_header") + 30)), "a mesh");
  expect(write("endless.ply", ply.substr(0, ply.find("end_header"))), "end_header");  // it looked on for ever
  expect(write("nan.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 nan 0\nf 1 2 3 4\n"), "a mesh");
  expect(write("points.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n"), "a mesh");
}

// Whatever is in a mesh file, it is read or refused: assimp runs in a process of its own, since some of these end it
// and some keep it for ever.
TEST_F(MeshFile, SurvivesWhateverIsInIt) {
  const char* other = std::getenv("PROXARM_TEST_SEED");  // other damage for each number
  const std::uint64_t seed = 903 + (other != nullptr ? 1000 * std::strtoull(other, nullptr, 10) : 0);
  Random random(seed);
  const TriangleSoup soup = ball(1, 0.5);
  const std::vector<std::pair<std::string, std::string>> whole{
      {"some.stl", stl_of(soup)},
      {"some.obj", obj_of(soup)},
      {"some.ply", ply_of(soup)},
      {"text.stl", text_stl_of(soup)},
      {"bytes.ply", binary_ply_of(soup)},
      {"star.obj", text_of(source_file("scenes/meshes/star.obj"))},
      {"rich.obj",
       "mtllib none.mtl\no thing\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nvn 0 0 1\nvt 0 0\ng side\n"
       "usemtl red\ns off\nf 1/1/1 2/1/1 3/1/1 4/1/1\nf -5 -4 -1\nl 1 2\nf 1//1 3//1 5//1\n"}};
  std::int64_t read = 0, refused = 0;
  double longest_s = 0.0;
  for (std::int64_t i = 0; i < std::max(scaled(350), std::int64_t{350}); ++i) {
    const auto& [name, sound] = whole[static_cast<std::size_t>(i) % whole.size()];
    std::string text = sound;
    for (int k = random.below(4); k >= 0 && !text.empty(); --k) {
      const auto size = static_cast<int>(text.size());
      const auto at = static_cast<std::size_t>(random.below(random.chance(0.5) ? std::min(size, 300) : size));
      const auto length = static_cast<std::size_t>(1 + random.below(20));
      switch (random.below(6)) {
        case 0:
          text.resize(at);
          break;
        case 1:
          text[at] = static_cast<char>(random.below(256));
          break;
        case 2:
          text.erase(at, length);
          break;
        case 3:
          text.insert(at, text.substr(at, length));
          break;
        case 4:
          text.replace(at, 1,
                       std::array{"nan", "-1", "99999999999", "1e999", "0", "\n",
                                  "f 1 1 1\n"}[static_cast<std::size_t>(random.below(7))]);
          break;
        default:
          text.replace(at, length, std::string(length, random.chance(0.5) ? '\xff' : '\0'));
      }
    }
    const auto file = write(name, text);
    const auto begun = std::chrono::steady_clock::now();
    try {
      const auto mesh = scenes::load_mesh(file, {1.0, models::Pose::Identity()}).mesh;
      ASSERT_GT(mesh->size(), 0u);
      ASSERT_TRUE(mesh->bounds().finite());
      ++read;
    } catch (const SetupError& error) {
      ASSERT_THAT(error.what(), testing::HasSubstr(file.string())) << "file " << i << ", seed " << seed;
      ASSERT_EQ(std::string(error.what()).find_first_of("\n\r\x1b"), std::string::npos) << i << ", seed " << seed;
      ++refused;
    }
    const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - begun;
    longest_s = std::max(longest_s, taken.count());
    // Three times the 2 s of processor time that the reader has at most, and room for a busy machine.
    ASSERT_LT(taken.count(), 12.0) << "file " << i << ", seed " << seed;
  }
  std::cout << "  " << read << " read, " << refused << " refused, the longest in " << longest_s << " s, seed " << seed
            << "\n";
  EXPECT_GT(read, 0);
  EXPECT_GT(refused, 0);
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
  EXPECT_NEAR(scenes::Clearances(alone).of_point({0, 0, 1.5}), 0.25, 1e-15);
  EXPECT_NEAR(scenes::Clearances(alone).of_point({0, 0, 1.2}), -0.05, 1e-15);
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
           "objects:\n  - mesh: {file: block.stl, layer: {thickness_m: 0.01, stiffness_N_per_m: 100}}\n",
           "media:\n  - viscous: {damping_Ns_per_m: 1, within: {mesh: {file: block.stl}}}\n",
       }) {
    EXPECT_THROW(scenes::compile(scene(text)), SetupError) << text;
  }
  EXPECT_NO_THROW(scenes::compile(scene("objects:\n  - mesh: {file: open.stl}\n")));
  EXPECT_NO_THROW(scenes::compile(scene("objects:\n  - mesh: {file: block.stl, inside_out: true}\n")));
}

// A flat sheet, smooth for x < 0 and rough beyond: pushed along at 45 degrees to it, the proxy slides over the smooth
// half and sticks on the rough one. Alone, and in a world of several objects.
TEST_F(MeshFile, HasFrictionByRegion) {
  TriangleSoup sheet;
  constexpr std::uint32_t side = 20;
  for (std::uint32_t i = 0; i <= side; ++i) {
    for (std::uint32_t j = 0; j <= side; ++j) sheet.vertices.emplace_back(-1.0 + 0.1 * i, -1.0 + 0.1 * j, 0.0);
  }
  for (std::uint32_t i = 0; i < side; ++i) {
    for (std::uint32_t j = 0; j < side; ++j) {
      const std::uint32_t a = i * (side + 1) + j, b = a + side + 1;
      sheet.triangles.push_back({a, b, b + 1});
      sheet.triangles.push_back({a, b + 1, a + 1});
    }
  }
  write("sheet.obj", obj_of(sheet));
  const std::string mesh =
      "objects:\n"
      "  - mesh:\n"
      "      file: sheet.obj\n"
      "      friction: 0.1\n"
      "      friction_regions:\n"
      "        - within: {box: {centre_m: [1, 0, 0], size_m: [2, 3, 1]}}\n"
      "          friction: 2\n";
  for (const std::string& other : {std::string(), std::string("  - sphere: {centre_m: [0, 0, 2], radius_m: 0.1}\n")}) {
    const CompiledScene compiled = scenes::compile(scene(mesh + other));
    auto& g = compiled.algorithm<3>();
    Vec3 q(-0.505, 0.03, 0.0);
    q = g(1e6, q - Vec3(0, 0, 1e-6), q + Vec3(0, 0, 1e-3));
    for (int k = 0; k < 2000; ++k) q = g(1e6, q + 5e-4 * Vec3(1, 0, -1), q);
    EXPECT_NEAR(q.x(), 0.0, 5e-4) << "stops where it gets rough";  // a step
    EXPECT_NEAR(q.y(), 0.03, 1e-12);
    const double on_smooth = g(1e6, Vec3(-0.5 + 1e-3, 0.03, -1e-3), Vec3(-0.5, 0.03, 0.0)).x() + 0.5;
    EXPECT_NEAR(on_smooth, 0.9e-3, 1e-12);  // (4): what friction of 0.1 leaves
  }
}

// The same, cut to a line of the plane y = 0.03 by a proxy's space of two dimensions.
TEST_F(MeshFile, HasFrictionByRegionInAPlane) {
  write("sheet.obj", obj_of(field(20, 1.0, [](double, double) { return 0.0; })));
  const CompiledScene compiled = scenes::compile(
      scene("dimensions: 2\nspace: {origin_m: [0, 0.03, 0], axes: [[1, 0, 0], [0, 0, 1]]}\n"
            "objects:\n  - mesh:\n      file: sheet.obj\n      friction: 0.1\n"
            "      friction_regions: [{within: {box: {centre_m: [1, 0, 0], size_m: [2, 3, 1]}}, friction: 2}]\n"));
  using Vec2 = models::Vec<2>;
  auto& g = compiled.algorithm<2>();
  EXPECT_NEAR(g(1e6, Vec2(-0.5 + 1e-3, -1e-3), Vec2(-0.5, 0.0)).x() + 0.5, 0.9e-3, 1e-12);
  EXPECT_NEAR(g(1e6, Vec2(0.5 + 1e-3, -1e-3), Vec2(0.5, 0.0)).x() - 0.5, 0.0, 1e-12);
  EXPECT_NEAR(g(1e6, Vec2(0.5 + 3e-3, -1e-3), Vec2(0.5, 0.0)).x() - 0.5, 1e-3, 1e-12);
}

// A sheet that is drawn away under a proxy pressed on it, half of it rough: friction acts against the relative motion.
TEST_F(MeshFile, MovesWithFrictionByRegion) {
  write("sheet.obj", obj_of(field(2, 1.0, [](double, double) { return 0.0; })));
  for (const std::string motion : {"{velocity_m_per_s: [-0.5, 0, 0]}", "{driven: true}"}) {
    CompiledScene compiled = scenes::compile(
        scene("objects:\n"
              "  - mesh:\n"
              "      file: sheet.obj\n"
              "      friction: 0.1\n"
              "      friction_regions: [{within: {box: {centre_m: [1, 0, 0], size_m: [2, 3, 1]}}, friction: 2}]\n"
              "      motion: " +
              motion + "\n"));
    auto& g = compiled.algorithm<3>();
    Vec3 q(-0.5, 0.03, 1e-4);
    models::Pose X = models::Pose::Identity();
    for (int k = 1; k <= 2000; ++k) {
      X.translation().x() = -5e-4 * k;
      compiled.drive(0, X);
      g.set_time({.time_s = 1e-3 * k, .period_s = 1e-3});
      const Vec3 r = g(1e6, q - Vec3(0, 0, 1e-3), q);
      // On the rough half it rides along, on the other (4) leaves it 0.1 mm of 0.5 mm.
      const double on_sheet = q.x() + 5e-4 * (k - 1);
      if (k > 1 && std::abs(on_sheet) > 1e-3) {
        ASSERT_NEAR(r.x() - q.x(), on_sheet > 0.0 ? -5e-4 : -1e-4, 1e-12) << motion << k;
      }
      q = r;
    }
    EXPECT_GT(q.x() + 1.0, 0.0) << "came to the rough half";
  }
}

TEST_F(MeshFile, RefusesARegionThatHoldsNothing) {
  write("ball.obj", obj_of(ball(2, 0.5)));
  const auto refused = [&](const std::string& regions) {
    try {
      scenes::compile(scene("objects:\n  - mesh:\n      file: ball.obj\n      friction_regions: " + regions + "\n"));
    } catch (const SetupError& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  EXPECT_THAT(refused("[{within: {sphere: {centre_m: [3, 0, 0], radius_m: 1}}, friction: 0.5}]"),
              testing::HasSubstr("holds the middle of no triangle"));
  EXPECT_THAT(refused("[{within: {sphere: {centre_m: [0, 0, 0], radius_m: 1}}, friction: -1}]"),
              testing::HasSubstr("friction"));
  EXPECT_THAT(refused("[{within: {mesh: {file: ball.obj}}, friction: 1}]"), testing::HasSubstr("a mesh"));
  EXPECT_THAT(refused("[]"), testing::HasSubstr("friction_regions"));
}

}  // namespace
}  // namespace proxarm::tests
