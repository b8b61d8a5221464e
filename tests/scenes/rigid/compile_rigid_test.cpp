#include "scenes/rigid/compile_rigid.hpp"

#include <gtest/gtest.h>

#include "models/base/setup_error.hpp"
#include "models/mesh/mesh.hpp"

namespace proxarm::scenes {
namespace {

using models::Pose;
using models::Tool;
using models::Vec3;

Tool box(double edge_m) { return {{{models::BoxTool{Vec3::Constant(edge_m)}, Pose::Identity(), {}}}}; }
Tool sphere(double radius_m) { return {{{models::SphereTool{radius_m}, Pose::Identity(), {}}}}; }
Tool cylinder() { return {{{models::CylinderTool{0.02, 0.01}, Pose::Identity(), {}}}}; }

Scene scene_of(const Shape& shape) {
  Object object;
  object.name = "it";
  object.shape = shape;
  object.line = 7;
  Scene scene;
  scene.objects = {object};
  return scene;
}

MeshShape pyramid() {
  models::TriangleSoup soup;
  soup.vertices = {{0.2, 0.2, -0.1}, {-0.2, 0.2, -0.1}, {-0.2, -0.2, -0.1}, {0.2, -0.2, -0.1}, {0.0, 0.0, 0.1}};
  soup.triangles = {{0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}, {0, 2, 1}, {0, 3, 2}};
  MeshShape shape;
  shape.mesh = std::make_shared<const models::TriangleMesh>(std::move(soup));
  return shape;
}

TEST(CompileRigid, ABoxRestsOnAPlaneOfTheScene) {
  const auto g = compile_rigid(scene_of(PlaneShape{{0.0, 0.0, 0.1}, {0.0, 0.0, 2.0}}), box(0.02));
  models::ToolPose q, p;
  q.position.z() = 0.11;
  p.position.z() = 0.109;
  EXPECT_NEAR(g->step(1e6 * models::Mat6::Identity(), p, q).position.z(), 0.11, 1e-16);
  EXPECT_EQ(g->contacts().size(), 4U);
  EXPECT_NEAR(g->clearance_m(q), 0.0, 1e-16);
}

TEST(CompileRigid, AnObjectMovesAsTheSceneSays) {
  Scene scene = scene_of(BoxShape{Pose::Identity(), Vec3::Constant(0.2), true});
  scene.objects[0].motion.emplace();
  scene.objects[0].motion->velocity_m_per_s = Vec3(0.0, 0.0, 0.1);
  const auto g = compile_rigid(scene, box(0.02));
  EXPECT_TRUE(g->wants_time());
  models::ToolPose q;
  q.position.z() = -0.09;  // on the bottom of the hollow box, which lifts it
  for (int k = 1; k <= 100; ++k) {
    g->set_time({.time_s = 1e-3 * k, .period_s = 1e-3});
    q = g->step(1e6 * models::Mat6::Identity(), q, q);
  }
  EXPECT_NEAR(q.position.z(), -0.08, 1e-12);
  EXPECT_NEAR(g->clearance_at_m(q, 0.0), 0.01, 1e-12);
  EXPECT_FALSE(compile_rigid(scene_of(PlaneShape{}), box(0.02))->wants_time());
}

TEST(CompileRigid, ADrivenObjectWaitsUntilItIsDriven) {
  Scene scene = scene_of(BoxShape{Pose::Identity(), Vec3::Constant(0.2), false});
  scene.objects[0].motion.emplace();
  scene.objects[0].motion->driven = true;
  scene.objects[0].motion->velocity_m_per_s = Vec3(0.0, 0.0, 0.1);  // doesn't count
  const auto g = compile_rigid(scene, box(0.02));
  models::ToolPose q;
  q.position.z() = 0.11;
  g->set_time({.time_s = 1e-3, .period_s = 1e-3});
  q = g->step(1e6 * models::Mat6::Identity(), q, q);
  EXPECT_EQ(q.position.z(), 0.11);
  Pose X = Pose::Identity();
  X.translation().z() = 1e-3;
  g->drive(0, X);
  q = g->step(1e6 * models::Mat6::Identity(), q, q);
  EXPECT_NEAR(q.position.z(), 0.111, 1e-12);
}

// Along z, in steps of 2 mm, as far as it goes. The step that ends in touching without a force may be flagged: whether
// a force of rounding acts there isn't decided. None else.
double end_of_way(const Shape& shape, const Tool& tool, double from, double step) {
  const auto g = compile_rigid(scene_of(shape), tool);
  models::ToolPose q;
  q.position.z() = from;
  int unresolved = 0;
  for (int k = 0; k < 250; ++k) {
    models::ToolPose p = q;
    p.position.z() += step;
    q = g->step(1e6 * models::Mat6::Identity(), p, q);
    unresolved += g->unresolved() ? 1 : 0;
  }
  EXPECT_LE(unresolved, 1);
  return q.position.z();
}

TEST(CompileRigid, EveryShapeHoldsATool) {
  const double down = -0.002;
  EXPECT_NEAR(end_of_way(PlaneShape{}, box(0.02), 0.3, down), 0.01, 1e-12);
  EXPECT_NEAR(end_of_way(BoxShape{Pose::Identity(), Vec3::Constant(0.2), false}, box(0.02), 0.3, down), 0.11, 1e-12);
  EXPECT_NEAR(end_of_way(SphereShape{Vec3::Zero(), 0.1, false}, box(0.02), 0.3, down), 0.11, 1e-12);
  EXPECT_NEAR(end_of_way(CapsuleShape{{-0.1, 0.0, 0.0}, {0.1, 0.0, 0.0}, 0.05, false}, box(0.02), 0.3, down), 0.06,
              1e-12);
  EXPECT_NEAR(end_of_way(pyramid(), box(0.02), 0.3, down), 0.11, 1e-12);
}

TEST(CompileRigid, AMeshWhoseFacesDisagreeAboutItsInsideIsRefusedAtItsLine) {
  MeshShape shape = pyramid();
  models::TriangleSoup soup{shape.mesh->structure().vertices, shape.mesh->structure().triangles};
  const std::size_t faces = soup.triangles.size();
  for (std::size_t i = 0; i < 5; ++i) soup.vertices.emplace_back(soup.vertices[i] + Vec3(1.0, 0.0, 0.0));
  for (std::size_t i = 0; i < faces; ++i) {
    const auto& [a, b, c] = soup.triangles[i];
    soup.triangles.push_back({a + 5, c + 5, b + 5});
  }
  shape.mesh = std::make_shared<const models::TriangleMesh>(std::move(soup));
  try {
    compile_rigid(scene_of(shape), box(0.01));
    ADD_FAILURE() << "not refused";
  } catch (const description::SetupError& error) {
    EXPECT_NE(std::string(error.what()).find("fronts"), std::string::npos) << error.what();
    EXPECT_EQ(error.line(), 7);
  }
}

TEST(CompileRigid, EveryHollowShapeHoldsATool) {
  const double up = 0.002;
  const Vec3 below(0.0, 0.0, -0.1), above(0.0, 0.0, 0.1);
  for (const Tool& tool : {box(0.02), cylinder()}) {
    EXPECT_NEAR(end_of_way(BoxShape{Pose::Identity(), Vec3::Constant(0.2), true}, tool, 0.0, up), 0.09, 1e-12);
    EXPECT_NEAR(end_of_way(CylinderShape{below, above, 0.05, true}, tool, 0.0, up), 0.09, 1e-12);
  }
  EXPECT_NEAR(end_of_way(SphereShape{Vec3::Zero(), 0.1, true}, box(0.02), 0.0, up), std::sqrt(0.0098) - 0.01, 1e-12);
  EXPECT_NEAR(end_of_way(SphereShape{Vec3::Zero(), 0.1, true}, cylinder(), 0.0, up), std::sqrt(0.0099) - 0.01, 1e-12);
  EXPECT_NEAR(end_of_way(CapsuleShape{below, above, 0.05, true}, sphere(0.01), 0.0, up), 0.14, 1e-12);
}

TEST(CompileRigid, TellsHowDeepAPegIsThatIsTooThickForItsHole) {
  const Shape hole = CylinderShape{{0.0, 0.0, -0.1}, {0.0, 0.0, 0.1}, 0.01, true};
  const auto peg = [](double radius_m) { return Tool{{{models::CylinderTool{0.02, radius_m}, Pose::Identity(), {}}}}; };
  EXPECT_NEAR(compile_rigid(scene_of(hole), peg(0.00999))->clearance_m({}), 1e-5, 1e-15);
  EXPECT_NEAR(compile_rigid(scene_of(hole), peg(0.0105))->clearance_m({}), -5e-4, 1e-15);
  models::ToolPose outside;
  outside.position.x() = 0.05;
  EXPECT_NEAR(compile_rigid(scene_of(hole), peg(0.005))->clearance_m(outside), -0.045, 1e-15);
}

// The reason is in why_not(), with the line, and compile_rigid() throws it.
void expect_refused(const Scene& scene, const Tool& tool, const std::string& word, int line) {
  const std::optional<Refusal> no = why_not(scene, tool);
  ASSERT_TRUE(no.has_value()) << word;
  EXPECT_NE(no->why.find(word), std::string::npos) << no->why;
  EXPECT_EQ(no->line, line) << no->why;
  try {
    compile_rigid(scene, tool);
    ADD_FAILURE() << word << " isn't refused";
  } catch (const description::SetupError& error) {
    EXPECT_NE(std::string(error.what()).find(no->why), std::string::npos) << error.what();
  }
}

TEST(CompileRigid, RefusesASceneWithTheReason) {
  Scene flat;
  flat.space.dimensions = 2;
  expect_refused(flat, box(0.01), "three dimensions", 0);
  Scene honey;
  honey.media.emplace_back().line = 3;
  expect_refused(honey, box(0.01), "medium", 3);
  Scene dry;
  dry.coulomb_force_N = 1.0;
  dry.coulomb_line = 4;
  expect_refused(dry, box(0.01), "Coulomb", 4);
  Scene guided;
  guided.guide.emplace().line_number = 5;
  expect_refused(guided, box(0.01), "guide", 5);
}

TEST(CompileRigid, RefusesAnObjectWithTheReason) {
  Scene scene = scene_of(PlaneShape{});
  scene.objects[0].layer = ElasticLayer{0.001, 500.0};
  expect_refused(scene, box(0.01), "layer", 7);
  scene = scene_of(PlaneShape{});
  scene.objects[0].friction_regions.emplace_back();
  expect_refused(scene, sphere(0.01), "regions", 7);
}

TEST(CompileRigid, RefusesAToolBesideAnObjectWithTheReason) {
  models::TriangleSoup sheet;
  sheet.vertices = {{0.2, 0.2, -0.1}, {-0.2, 0.2, -0.1}, {-0.2, -0.2, -0.1}};
  sheet.triangles = {{0, 1, 2}};
  MeshShape open;
  open.mesh = std::make_shared<const models::TriangleMesh>(std::move(sheet));
  expect_refused(scene_of(open), sphere(0.01), "is open", 7);
  expect_refused(scene_of(CapsuleShape{{-0.1, 0.0, 0.0}, {0.1, 0.0, 0.0}, 0.05, true}), cylinder(), "round ends", 7);
}

TEST(CompileRigid, RefusesAToolWithoutASizeAlsoWhereNothingIsToTouch) {
  EXPECT_THROW(compile_rigid(scene_of(PlaneShape{}), box(0.0)), description::SetupError);
  EXPECT_THROW(compile_rigid(Scene{}, box(0.0)), description::SetupError);
  EXPECT_NE(dynamic_cast<models::FreePose*>(compile_rigid(Scene{}, box(0.01)).get()), nullptr);
}

}  // namespace
}  // namespace proxarm::scenes
