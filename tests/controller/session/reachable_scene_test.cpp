#include "controller/session/reachable_scene.hpp"

#include <gtest/gtest.h>

#include "models/arm/arm.hpp"
#include "scenes/format/scene_file.hpp"
#include "tests/source_file.hpp"

namespace proxarm::controller {
namespace {

description::Cell shipped(const std::string& name) {
  return description::load_cell(source_file("models/cells/" + name + ".yaml"));
}

TEST(ReachableScene, FreeSpaceOfAnArmWithTwoAxesIsItsPlane) {
  const description::Cell bench = shipped("bench");
  const scenes::Scene scene = reachable_scene(scenes::load_scene(source_file("scenes/free.yaml")), bench);
  EXPECT_EQ(scene.space.dimensions, 2);
  const models::Arm arm(bench);
  EXPECT_EQ(scene.space.origin_m, arm.tool_pose(arm.start_rad()).translation());
  EXPECT_EQ(scene.space.axes.col(0), models::Vec3::UnitX());
  EXPECT_EQ(scene.space.axes.col(1), models::Vec3::UnitZ());
  EXPECT_EQ(reachable_scene(scene, shipped("linear")).space.dimensions, 2) << "what states its space keeps it";
  EXPECT_EQ(reachable_scene({}, shipped("linear")).space.dimensions, 1);
}

TEST(ReachableScene, IsAnyOtherSceneAsItIsWritten) {
  const scenes::Scene wall = scenes::load_scene(source_file("scenes/wall.yaml"));
  EXPECT_EQ(reachable_scene(wall, shipped("bench")).space.dimensions, 3) << "run refuses that with words";
  for (const char* cell : {"default", "gantry", "scara", "seven"}) {
    EXPECT_EQ(reachable_scene({}, shipped(cell)).space.dimensions, 3) << cell;
  }
}

}  // namespace
}  // namespace proxarm::controller
