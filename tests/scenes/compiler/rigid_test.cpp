#include "scenes/compiler/rigid.hpp"

#include <gtest/gtest.h>

#include "models/base/setup_error.hpp"

namespace proxarm::scenes {
namespace {

models::Tool box(double edge_m) { return {{{models::BoxTool{models::Vec3::Constant(edge_m)}, {}, {}}}}; }

Object object_of(const Shape& shape) {
  Object object;
  object.name = "it";
  object.shape = shape;
  object.line = 7;
  return object;
}

TEST(CompileRigid, ABoxRestsOnAPlaneOfTheScene) {
  Scene scene;
  scene.objects = {object_of(PlaneShape{{0.0, 0.0, 0.1}, {0.0, 0.0, 2.0}})};
  const auto g = compile_rigid(scene, box(0.02));
  models::ToolPose q, p;
  q.position.z() = 0.11;
  p.position.z() = 0.109;
  EXPECT_EQ(g->step(models::Mat6(1e6 * models::Mat6::Identity()), p, q).position.z(), 0.11);
  EXPECT_EQ(g->contacts().size(), 4U);
  EXPECT_NEAR(g->clearance_m(q), 0.0, 1e-16);
}

TEST(CompileRigid, EveryShapeKeepsATool) {
  // From 0.2 m on the free side of each, pushed 0.5 m against it in steps of 2 mm: the tool ends at the surface.
  models::Pose X = models::Pose::Identity();
  const std::vector<std::pair<Shape, double>> cases = {
      {PlaneShape{}, 0.01},
      {BoxShape{X, models::Vec3::Constant(0.2), false}, 0.11},
      {SphereShape{{0.0, 0.0, 0.0}, 0.1, false}, 0.11},
      {CapsuleShape{{-0.1, 0.0, 0.0}, {0.1, 0.0, 0.0}, 0.05, false}, 0.06},
  };
  for (const auto& [shape, end] : cases) {
    Scene scene;
    scene.objects = {object_of(shape)};
    const auto g = compile_rigid(scene, box(0.02));
    models::ToolPose q;
    q.position.z() = 0.3;
    for (int k = 0; k < 250; ++k) {
      models::ToolPose p = q;
      p.position.z() -= 0.002;
      q = g->step(models::Mat6(1e6 * models::Mat6::Identity()), p, q);
      ASSERT_FALSE(g->unresolved()) << kind_of(shape);
    }
    EXPECT_NEAR(q.position.z(), end, 1e-12) << kind_of(shape);
  }
}

TEST(CompileRigid, RefusesWhatItCannotRenderWithTheReason) {
  const auto reason = [](const Scene& scene, const models::Tool& tool) {
    const std::optional<Refusal> no = why_not(scene, tool);
    EXPECT_TRUE(no.has_value());
    EXPECT_THROW(compile_rigid(scene, tool), description::SetupError);
    return no.value_or(Refusal{});
  };
  Scene soft;
  soft.objects = {object_of(PlaneShape{})};
  soft.objects[0].layer = ElasticLayer{0.001, 500.0};
  EXPECT_EQ(reason(soft, box(0.01)).line, 7);
  Scene flat;
  flat.space.dimensions = 2;
  EXPECT_NE(reason(flat, box(0.01)).why.find("three dimensions"), std::string::npos);
  Scene honey;
  honey.media.emplace_back();
  EXPECT_NE(reason(honey, box(0.01)).why.find("medium"), std::string::npos);
  Scene round;
  round.objects = {object_of(CylinderShape{})};
  EXPECT_NE(reason(round, box(0.01)).why.find("cylinder"), std::string::npos);
  Scene still;
  EXPECT_FALSE(why_not(still, box(0.01)).has_value());
  EXPECT_NE(dynamic_cast<models::FreePose*>(compile_rigid(still, box(0.01)).get()), nullptr);
  still.objects = {object_of(PlaneShape{})};
  EXPECT_THROW(compile_rigid(still, box(0.0)), description::SetupError);
}

}  // namespace
}  // namespace proxarm::scenes
