// From a scene's file to the smallest 𝒢 that renders it.
#include "scenes/compiler/compile.hpp"
#include "scenes/compiler/clearances.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <memory>
#include <utility>
#include <vector>

#include "models/base/setup_error.hpp"
#include "models/surfaces/coulomb_field.hpp"
#include "models/surfaces/free_space.hpp"
#include "models/surfaces/friction_plane.hpp"
#include "models/surfaces/plane.hpp"
#include "scenes/compiler/clearances.hpp"
#include "scenes/format/scene_file.hpp"
#include "tests/source_file.hpp"

namespace proxarm::tests {
namespace {

using models::Vec3;
using scenes::compile;
using scenes::CompiledScene;
using scenes::load_scene;
using scenes::parse_scene;

const std::filesystem::path scenes_folder = source_file("scenes");

template <typename Algorithm, int N>
bool is(const CompiledScene& scene) {
  return dynamic_cast<Algorithm*>(&scene.algorithm<N>()) != nullptr;
}

TEST(Compile, MakesTheSmallestAlgorithm) {
  EXPECT_TRUE((is<models::FreeSpace<3>, 3>(compile(load_scene(scenes_folder / "free.yaml")))));
  EXPECT_TRUE((is<models::Plane<3>, 3>(compile(load_scene(scenes_folder / "frictionless_wall.yaml")))));
  EXPECT_TRUE((is<models::FrictionPlane<3>, 3>(compile(load_scene(scenes_folder / "wall.yaml")))));
  EXPECT_TRUE((is<models::CoulombField<3>, 3>(compile(load_scene(scenes_folder / "coulomb.yaml")))));
}

TEST(Compile, EveryShippedSceneLoads) {
  for (const auto& entry : std::filesystem::directory_iterator(scenes_folder)) {
    if (entry.path().extension() != ".yaml") continue;
    EXPECT_NO_THROW(compile(load_scene(entry.path()))) << entry.path();
  }
}

TEST(Compile, SaysWhatIsSkippedAndWhy) {
  const scenes::Scene scene = load_scene(scenes_folder / "frictionless_wall.yaml");
  const scenes::Plan plan = compile(scene).plan;
  EXPECT_EQ(plan.contacts, scenes::Plan::Contacts::plane);
  EXPECT_EQ(plan.friction, scenes::Plan::Friction::none);
  EXPECT_EQ(plan.only_object, 0);
  const scenes::Narration told = narrate(scene, plan);
  ASSERT_EQ(told.stages.size(), 1u);
  EXPECT_EQ(told.stages[0].what, "wall, equation (2)");
  bool friction = false;
  for (const auto& stage : told.skipped) friction = friction || (stage.what == "friction" && stage.why == "μ = 0");
  EXPECT_TRUE(friction);
}

TEST(Compile, PlansNoMoreThanASceneNeeds) {
  using Contacts = scenes::Plan::Contacts;
  const std::vector<std::pair<const char*, Contacts>> plans{
      {"free", Contacts::none},       {"coulomb", Contacts::none},
      {"line", Contacts::plane},      {"plane_2d", Contacts::friction_plane},
      {"groove", Contacts::planes},   {"guide", Contacts::guide},
      {"soft_wall", Contacts::world}, {"guided_insertion", Contacts::guide_among_objects}};
  for (const auto& [name, contacts] : plans) {
    EXPECT_EQ(compile(load_scene(scenes_folder / (std::string(name) + ".yaml"))).plan.contacts, contacts) << name;
  }
  const std::string star = source_file("scenes/meshes/star.obj").string();
  EXPECT_EQ(compile(parse_scene("objects:\n  - mesh: {file: " + star + "}\n", "star.yaml")).plan.contacts,
            Contacts::mesh);
}

// The words once counted all objects of the file, and called friction on a line what has no tangent to slip along.
TEST(Compile, PlansForWhatTheProxysSpaceMeetsAlone) {
  const scenes::Scene scene = parse_scene(
      "dimensions: 1\nspace: {axes: [[1, 0, 0]]}\nobjects:\n"
      "  - box: {name: far, centre_m: [0, 0, 9], size_m: [1, 1, 1], friction: 0.5, "
      "layer: {thickness_m: 0.1, stiffness_N_per_m: 1}, motion: {velocity_m_per_s: [1, 0, 0]}}\n"
      "  - box: {name: near, centre_m: [2, 0, 0], size_m: [1, 1, 1], friction: 0.3}\n"
      "  - box: {name: room, centre_m: [0, 0, 0], size_m: [8, 8, 8], inside_out: true}\n",
      "one.yaml");
  const scenes::Plan plan = compile(scene).plan;
  EXPECT_EQ(plan.contacts, scenes::Plan::Contacts::world);
  EXPECT_EQ(plan.missed, std::vector<std::int32_t>{0}) << "a room's walls along the line don't make it a miss";
  EXPECT_EQ(plan.surfaces, 3u) << "a box and the ends of the room";
  EXPECT_EQ(plan.moving, 0u);
  EXPECT_EQ(plan.layers, 0u);
  EXPECT_EQ(plan.friction, scenes::Plan::Friction::no_tangent);
  for (const auto& stage : narrate(scene, plan).stages) EXPECT_EQ(stage.what.find("friction"), std::string::npos);
}

TEST(Compile, CutsAPlaneWithTheSpaceOfTheProxy) {
  // A wall at x = 0.9 that leans by 45°, met on a plane and on a line.
  const auto text = [](int n, const char* axes) {
    return "dimensions: " + std::to_string(n) + "\nspace: {origin_m: [0.7, 0, 0.6], axes: [" + axes +
           "]}\nobjects:\n  - plane: {point_m: [0.9, 0, 0.6], normal: [-1, 0, -1], friction: 0.3}\n";
  };
  const CompiledScene plane = compile(parse_scene(text(2, "[2, 0, 0], [0, 1, 0]"), "plane.yaml"));
  ASSERT_EQ(plane.dimensions(), 2);
  auto& g2 = plane.algorithm<2>();
  EXPECT_TRUE(g2(1.0, {0.19, 5.0}, {0.0, 0.0}).isApprox(models::Vec<2>(0.19, 5.0)));
  EXPECT_NEAR(g2(1.0, {0.3, 0.0}, {0.0, 0.0}).x(), 0.2, 1e-15);
  EXPECT_TRUE(plane.to_W<2>({0.2, 1.0}).isApprox(Vec3(0.9, 1.0, 0.6)));
  EXPECT_TRUE(plane.from_W<2>({0.9, 1.0, 7.0}).isApprox(models::Vec<2>(0.2, 1.0)));

  const CompiledScene line = compile(parse_scene(text(1, "[0, 0, 1]"), "line.yaml"));
  auto& g1 = line.algorithm<1>();
  EXPECT_NEAR(g1(1.0, models::Vec<1>(0.5), models::Vec<1>(0.0))[0], 0.2, 1e-15);

  // Parallel to the space: out of reach, or all around.
  const std::string parallel = "dimensions: 1\nspace: {origin_m: [0, 0, 0], axes: [[0, 1, 0]]}\nobjects:\n  - plane: ";
  EXPECT_TRUE((is<models::FreeSpace<1>, 1>(
      compile(parse_scene(parallel + "{point_m: [1, 0, 0], normal: [-1, 0, 0]}\n", "a.yaml")))));
  EXPECT_THROW(compile(parse_scene(parallel + "{point_m: [1, 0, 0], normal: [1, 0, 0]}\n", "a.yaml")),
               description::SetupError);
}

TEST(Compile, ComposesPlanesInAnyDimension) {
  const char* objects =
      "objects:\n"
      "  - plane: {point_m: [0, 0, 0], normal: [1, 0, 0], friction: 0.3}\n"
      "  - plane: {point_m: [0, 0, 0], normal: [0, 1, 0], friction: 0.3}\n"
      "  - plane: {point_m: [1, 0, 0], normal: [-1, 0, 0], friction: 0.3}\n";
  const CompiledScene three = compile(parse_scene(objects, "c.yaml"));
  EXPECT_TRUE(three.algorithm<3>()(1.0, {-1, -2, 0}, {0, 0, 0}).isZero(1e-15));
  EXPECT_EQ(three.algorithm<3>().contacts().size(), 2u);
  const CompiledScene two =
      compile(parse_scene(std::string("dimensions: 2\nspace: {axes: [[1, 0, 0], [0, 1, 0]]}\n") + objects, "c.yaml"));
  EXPECT_TRUE(two.algorithm<2>()(1.0, {-1, -2}, {0, 0}).isZero(1e-15));
  EXPECT_EQ(two.algorithm<2>().contacts().size(), 2u);
  const CompiledScene one =
      compile(parse_scene(std::string("dimensions: 1\nspace: {axes: [[1, 0, 0]]}\n") + objects, "c.yaml"));
  EXPECT_NEAR(one.algorithm<1>()(1.0, models::Vec<1>(-1.0), models::Vec<1>(0.5))[0], 0.0, 1e-15);
  EXPECT_NEAR(one.algorithm<1>()(1.0, models::Vec<1>(3.0), models::Vec<1>(0.5))[0], 1.0, 1e-15);
}

TEST(Compile, KnowsEveryShape) {
  const CompiledScene room = compile(load_scene(scenes_folder / "room.yaml"));
  auto& g = room.algorithm<3>();
  // Into the corner of the room: three faces of one box.
  Vec3 q(0.7, 0, 0.6);
  for (int k = 0; k < 50; ++k) q = g(1.0, q + Vec3(-0.02, 0.03, 0.05), q);
  EXPECT_LE((q - Vec3(0.45, 0.25, 0.85)).norm(), 1e-14);
  for (const auto& contact : g.contacts()) EXPECT_EQ(contact.object, 0);
  // Down onto the ball.
  q = Vec3(0.88, 0.1, 0.6);
  for (int k = 0; k < 50; ++k) q = g(1.0, q - Vec3(0, 0, 0.01), q);
  EXPECT_LE((q - Vec3(0.88, 0.1, 0.49)).norm(), 1e-14);
  ASSERT_EQ(g.contacts().size(), 1u);
  EXPECT_EQ(g.contacts()[0].object, 1);
}

TEST(Compile, GivesWayUnderALayer) {
  auto scene = compile(load_scene(scenes_folder / "soft_wall.yaml"));
  auto& g = scene.algorithm<3>();
  Vec3 q(0.88, 0, 0.6);
  for (int k = 0; k < 5000; ++k) q = g(1e6, q + Vec3(10.0 / 1e6, 0, 0), q);  // 10 N
  EXPECT_NEAR(q.x(), 0.885, 1e-6);                                           // settled to e⁻¹⁰ of 5 mm
}

TEST(Compile, MovesWhatMoves) {
  auto scene = compile(load_scene(scenes_folder / "moving_plate.yaml"));
  auto& g = scene.algorithm<3>();
  Vec3 q(0.85, 0, 0.6);
  const double T = 1e-3;
  double least = 1.0;
  for (int k = 1; k <= 5000; ++k) {
    g.set_time({.time_s = k * T, .period_s = T});
    q = g(1e6, q, q);
    least = std::min(least, q.x());
  }
  EXPECT_NEAR(least, 0.79, 1e-12);  // the plate's face at its foremost
}

TEST(Compile, DrivesFromOutside) {
  auto scene = compile(parse_scene(
      "objects:\n  - plane: {point_m: [0, 0, 0], normal: [0, 0, 1], motion: {driven: true}}\n", "driven.yaml"));
  models::Pose X = models::Pose::Identity();
  X.translation().z() = 0.3;
  scene.drive(0, X);
  const Vec3 q(0, 0, 0.1);
  EXPECT_NEAR(scene.algorithm<3>()(1.0, q, q).z(), 0.3, 1e-15);
}

TEST(Compile, RefusesWhatCantBe) {
  const auto refuses = [](const std::string& text) {
    EXPECT_THROW(compile(parse_scene(text, "scene.yaml")), description::SetupError) << text;
  };
  const std::string two = "dimensions: 2\nspace: {axes: [[1, 0, 0], [0, 1, 0]]}\n";
  refuses(two + "objects:\n  - capsule: {from_m: [0, 0, 0], to_m: [1, 0, 1], radius_m: 0.1}\n");
  refuses(two + "guide: {line: {point_m: [0, 0, 0], direction: [1, 0, 1]}}\n");
  refuses(two + "objects:\n  - sphere: {centre_m: [0, 0, 2], radius_m: 1, inside_out: true}\n");
  const std::string box = "objects:\n  - box: {centre_m: [0, 0, 0], size_m: [1, 1, 1], ";
  refuses(box + "layer: {thickness_m: 0.5, stiffness_N_per_m: 1}}\n");
  for (const std::string side : {"", "inside_out: true, "}) {
    const std::string padded = box + side + "layer: {thickness_m: 0.1, stiffness_N_per_m: 1}}\n";
    EXPECT_NO_THROW(compile(parse_scene(padded, "scene.yaml"))) << padded;
  }
}

TEST(Compile, CutsSpheresInFewerDimensions) {
  const std::string ball =
      "objects:\n  - sphere: {centre_m: [0, 0, 0.3], radius_m: 0.5, inside_out: true, friction: 0.3}\n";
  auto two = compile(parse_scene("dimensions: 2\nspace: {axes: [[1, 0, 0], [0, 1, 0]]}\n" + ball, "two.yaml"));
  EXPECT_NEAR(two.algorithm<2>()(1.0, {3, 4}, {0, 0}).norm(), 0.4, 1e-15);
  auto one = compile(parse_scene("dimensions: 1\nspace: {axes: [[1, 0, 0]]}\n" + ball, "one.yaml"));
  EXPECT_NEAR(one.algorithm<1>()(1.0, models::Vec<1>(-2.0), models::Vec<1>(0.1))[0], -0.4, 1e-15);
}

TEST(Clearance, IsTheDistanceToTheNearestSurface) {
  const scenes::Scene scene = load_scene(scenes_folder / "wall.yaml");
  EXPECT_NEAR(scenes::Clearances(scene).of_point({0.7, 3.0, -2.0}), 0.2, 1e-15);
  EXPECT_NEAR(scenes::Clearances(scene).of_point({1.0, 3.0, -2.0}), -0.1, 1e-15);
  EXPECT_EQ(scenes::Clearances(load_scene(scenes_folder / "free.yaml")).of_point(Vec3::Zero()),
            std::numeric_limits<double>::infinity());
}

// The story: a tool that had sunk 381 µm behind a sheet was said not to have, since an open mesh has no inside.
TEST(Clearance, OfAToolBehindASheetIsNegative) {
  models::TriangleSoup soup;
  soup.vertices = {{0.9, -1.0, -1.0}, {0.9, 1.0, -1.0}, {0.9, 1.0, 1.0}, {0.9, -1.0, 1.0}};
  soup.triangles = {{0, 1, 2}, {0, 2, 3}};
  scenes::MeshShape shape;
  shape.mesh = std::make_shared<const models::TriangleMesh>(soup);
  scenes::Scene scene;
  scene.objects.emplace_back();
  scene.objects.back().shape = shape;
  const Vec3 proxy(0.9 - shape.mesh->lift_m(), 0.1, 0.2), behind(0.9 + 381e-6, 0.1, 0.2), before(0.89, 0.1, 0.2);
  EXPECT_NEAR(scenes::Clearances(scene).of_tool(behind, proxy, 0.0), -381e-6, 1e-12);
  EXPECT_NEAR(scenes::Clearances(scene).of_tool(before, proxy, 0.0), 0.01, 1e-12);
  EXPECT_NEAR(scenes::Clearances(scene).of_tool(proxy, behind, 0.0), -shape.mesh->lift_m(), 1e-12)
      << "from the other side";
  const Vec3 beside(0.95, 1.5, 0.2), led(0.9, 1.5, 0.2);
  EXPECT_GT(scenes::Clearances(scene).of_tool(beside, led, 0.0), 0.0) << "nothing is between them";
}

// The plate of moving_plate.yaml is 20 mm thick and swings by 0.1 m along x about x = 0.9, once in 5 s.
TEST(Clearance, IsToWhereThingsAreByThen) {
  const scenes::Scene scene = load_scene(scenes_folder / "moving_plate.yaml");
  const Vec3 x(0.7, 0.0, 0.6);
  EXPECT_NEAR(scenes::Clearances(scene).of_point(x, 0.0), 0.19, 1e-12);
  EXPECT_NEAR(scenes::Clearances(scene).of_point(x, 1.25), 0.29, 1e-12);
  EXPECT_NEAR(scenes::Clearances(scene).of_point(x, 3.75), 0.09, 1e-12);
}

}  // namespace
}  // namespace proxarm::tests
