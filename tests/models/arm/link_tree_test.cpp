#include "models/arm/link_tree.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <random>

#include "models/arm/arm.hpp"
#include "tests/source_file.hpp"

namespace proxarm::models {
namespace {

const DrawnLink& link_named(const LinkTree& tree, const std::string& name) {
  for (const DrawnLink& link : tree.links()) {
    if (link.name == name) return link;
  }
  throw std::out_of_range(name);
}

// The arm's own kinematics, which MuJoCo and KDL vouch for, as the witness.
TEST(LinkTree, PutsTheSensorsLinkWhereTheArmHasIt) {
  for (const char* file : {"models/cells/default.yaml", "models/cells/light.yaml", "models/cells/rail.yaml"}) {
    const description::Cell cell = description::load_cell(source_file(file));
    const Arm arm(cell);
    const LinkTree tree(cell);
    const auto sensor = std::find_if(tree.links().begin(), tree.links().end(),
                                     [&](const DrawnLink& link) { return link.name == cell.sensor.link; });
    ASSERT_NE(sensor, tree.links().end());
    std::mt19937 dice(5);
    std::uniform_real_distribution<double> angle(-1.5, 1.5);
    for (int i = 0; i < 200; ++i) {
      JointVector q(arm.axes());
      for (int k = 0; k < arm.axes(); ++k) q[k] = angle(dice);
      std::vector<Pose> X_W;
      tree.place(q, X_W);
      const Pose X_WS = X_W[static_cast<std::size_t>(sensor - tree.links().begin())] * to_pose(cell.sensor.pose_link);
      EXPECT_LT((X_WS.matrix() - arm.sensor_pose(q).matrix()).cwiseAbs().maxCoeff(), 1e-12) << file;
    }
  }
}

TEST(LinkTree, HasTheShapesOfTheUrdf) {
  const LinkTree tree(description::load_cell(source_file("models/cells/default.yaml")));
  EXPECT_TRUE(tree.notes().empty());
  ASSERT_EQ(tree.links().size(), 8U);
  const DrawnLink& upper_arm = link_named(tree, "link_2");
  ASSERT_EQ(upper_arm.shapes.size(), 3U);
  const auto& box = std::get<DrawnBox>(upper_arm.shapes[0].shape);
  EXPECT_EQ(box.size_m, Vec3(0.14, 0.1, 0.44));
  EXPECT_EQ(upper_arm.shapes[0].X_link.translation(), Vec3(0, 0, 0.3));
  EXPECT_EQ(std::get<DrawnCylinder>(upper_arm.shapes[1].shape).radius_m, 0.085);
}

TEST(LinkTree, LeavesOutWhatCantBeDrawnAndSaysSo) {
  description::Cell cell = description::load_cell(source_file("models/cells/default.yaml"));
  std::ifstream in(cell.urdf);
  std::string text{std::istreambuf_iterator<char>(in), {}};
  const auto replace = [&](const std::string& from, const std::string& to) {
    ASSERT_NE(text.find(from), std::string::npos);
    text.replace(text.find(from), from.size(), to);
  };
  replace("<geometry><box size=\"0.14 0.1 0.44\"/></geometry>", "<geometry><torus radius=\"1\"/></geometry>");
  replace("<geometry><box size=\"0.24 0.16 0.16\"/></geometry>",
          "<geometry><mesh filename=\"package://arm/meshes/a.stl\" scale=\"0.001 0.001 0.001\"/></geometry>"
          "<material name=\"m\"><color rgba=\"1 0.5 0 1\"/></material>");
  cell.urdf = std::filesystem::path(testing::TempDir()) / "link_tree_test.urdf";
  std::ofstream(cell.urdf) << text;
  const LinkTree tree(cell);
  ASSERT_EQ(tree.notes().size(), 1U);
  EXPECT_NE(tree.notes()[0].find("link link_2"), std::string::npos);
  const LinkShape& shape = link_named(tree, "link_3").shapes.at(0);
  EXPECT_EQ(std::get<DrawnMesh>(shape.shape).file.filename(), "a.stl");
  EXPECT_EQ(std::get<DrawnMesh>(shape.shape).scale.x(), 0.001);
  ASSERT_TRUE(shape.colour);
  EXPECT_EQ((*shape.colour)[1], 0.5);
  std::filesystem::remove(cell.urdf);
}

}  // namespace
}  // namespace proxarm::models
