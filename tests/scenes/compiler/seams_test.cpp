// The story: a point fell by 43 mm into the seam of two boxes that stand side by side, and passed below a box that
// stands on a table.
#include "scenes/compiler/seams.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "scenes/compiler/compile.hpp"
#include "scenes/format/scene_file.hpp"

namespace proxarm::tests {
namespace {

using models::Mat3;
using models::Pose;
using models::Vec3;
using scenes::BoxShape;
using scenes::CylinderShape;
using scenes::Object;
using scenes::PlaneShape;
using scenes::Scene;

constexpr double K = 2e6;  // 2 kg at 1 kHz

Object object(scenes::Shape shape, double friction = 0.0) {
  Object made;
  made.shape = std::move(shape);
  made.friction = friction;
  return made;
}

Scene scene_of(std::vector<Object> objects) {
  Scene scene;
  for (Object& made : objects) {
    made.name = "object " + std::to_string(scene.objects.size() + 1);
    scene.objects.push_back(std::move(made));
  }
  return scene;
}

Pose turned(std::mt19937& chance) {
  std::normal_distribution<double> any(0.0, 1.0);
  Pose pose = Pose::Identity();
  pose.linear() =
      Eigen::Quaterniond(any(chance), any(chance), any(chance), any(chance)).normalized().toRotationMatrix();
  pose.translation() = Vec3(any(chance), any(chance), any(chance));
  return pose;
}

// Tiles of one floor, whose tops are at z = 0 of `frame` but for steps of up to `step_m`, with gaps of up to `gap_m`.
std::vector<Object> floor_of(const Pose& frame, int columns, int rows, double gap_m, double step_m, double friction,
                             std::mt19937& chance) {
  std::uniform_real_distribution<double> any(0.0, 1.0);
  std::vector<double> edges_x{0.0}, edges_y{0.0};
  for (int i = 0; i < columns; ++i) edges_x.push_back(edges_x.back() + 0.05 + 0.1 * any(chance));
  for (int i = 0; i < rows; ++i) edges_y.push_back(edges_y.back() + 0.05 + 0.1 * any(chance));
  std::vector<Object> tiles;
  for (int i = 0; i < columns; ++i) {
    for (int j = 0; j < rows; ++j) {
      const double thick = 0.02 + 0.1 * any(chance), top = step_m * (any(chance) - 0.5), gap = gap_m * any(chance);
      const Vec3 low(edges_x[i] + 0.5 * gap, edges_y[j] + 0.5 * gap, top - thick);
      const Vec3 high(edges_x[i + 1] - 0.5 * gap, edges_y[j + 1] - 0.5 * gap, top);
      BoxShape box;
      box.pose_W = frame;
      box.pose_W.translation() = frame * (0.5 * (low + high));
      box.size_m = high - low;
      tiles.push_back(object(box, friction));
    }
  }
  return tiles;
}

struct Way {
  double deepest_m = 0.0, highest_m = 0.0;  // below and above z = 0 of the frame
  double off_m = 0.0;                       // of the end from where it was led, along the floor
};

// Leads a point along a straight line over the floor, pressed to `depth_m` below it.
Way led(scenes::CompiledScene& scene, const Pose& frame, const Vec3& from, const Vec3& to, double depth_m, int steps) {
  auto& g = scene.algorithm<3>();
  Vec3 q = frame * Vec3(from.x(), from.y(), 0.01);
  Way way;
  for (int k = 0; k <= steps; ++k) {
    const Vec3 at = from + (to - from) * k / steps;
    q = g(K, frame * Vec3(at.x(), at.y(), -depth_m), q);
    const Vec3 x = frame.inverse() * q;
    if (k == 0) continue;  // it comes down
    way.deepest_m = std::max(way.deepest_m, -x.z());
    way.highest_m = std::max(way.highest_m, x.z());
  }
  way.off_m = ((frame.inverse() * q) - to).head<2>().norm();
  return way;
}

TEST(Seams, APointSlidesOverRandomFloorsAndFallsNowhere) {
  std::mt19937 chance(7);
  std::uniform_real_distribution<double> any(0.0, 1.0);
  constexpr int floors = 300;
  for (int n = 0; n < floors; ++n) {
    const Pose frame = n % 3 == 0 ? Pose::Identity() : turned(chance);
    const double gap_m = n % 2 == 0 ? 0.0 : scenes::joined_m, step_m = n % 4 < 2 ? 0.0 : scenes::joined_m;
    const double friction = n % 5 == 0 ? 0.4 : 0.0;
    const int columns = 1 + static_cast<int>(4.0 * any(chance)), rows = 1 + static_cast<int>(3.0 * any(chance));
    const std::vector<Object> tiles = floor_of(frame, columns, rows, gap_m, step_m, friction, chance);
    const Scene scene = scene_of(tiles);
    scenes::CompiledScene compiled = compile(scene);
    EXPECT_EQ(compiled.plan.joined.size(), static_cast<std::size_t>((columns - 1) * rows + columns * (rows - 1))) << n;
    const auto& last = std::get<BoxShape>(tiles.back().shape);
    const Vec3 end = frame.inverse() * last.pose_W.translation() + 0.5 * last.size_m;
    for (int line = 0; line < 12; ++line) {
      const Vec3 from(end.x() * any(chance), end.y() * any(chance), 0.0),
          to(end.x() * any(chance), end.y() * any(chance), 0.0);
      // A proxy of 2 kg at 1 kHz under 0.1 to 2000 N, at 0.01 to 1 m/s.
      const double depth_m = std::pow(10.0, -7.0 + 4.0 * any(chance)), step = std::pow(10.0, -5.0 + 2.0 * any(chance));
      const Way way = led(compiled, frame, from, to, depth_m, 2 + static_cast<int>((to - from).norm() / step));
      ASSERT_LE(way.deepest_m, 0.5 * step_m + 1e-12) << n << ", " << line << ", pressed by " << depth_m << " m";
      ASSERT_LE(way.highest_m, 0.5 * step_m + 1e-12) << n << ", " << line;
      const double held_back_m = friction * (depth_m + step_m) * (1.0 + 1e-9);
      ASSERT_LE(way.off_m, held_back_m + 1e-9) << n << ", " << line << ": it stopped on its way";
    }
  }
}

// Along the seams themselves and through the corners where four tiles meet, at coordinates that are exact.
TEST(Seams, APointSlidesAlongASeamAndThroughACorner) {
  std::vector<Object> tiles;
  for (const double x : {-0.25, 0.25}) {
    for (const double y : {-0.25, 0.25}) {
      BoxShape box;
      box.pose_W.translation() = Vec3(x, y, -0.0625);
      box.size_m = Vec3(0.5, 0.5, 0.125);
      tiles.push_back(object(box));
    }
  }
  scenes::CompiledScene compiled = compile(scene_of(tiles));
  const std::array<std::pair<Vec3, Vec3>, 4> ways{{{Vec3(-0.25, 0, 0), Vec3(0.25, 0, 0)},
                                                   {Vec3(0, 0.25, 0), Vec3(0, -0.25, 0)},
                                                   {Vec3(-0.25, -0.25, 0), Vec3(0.25, 0.25, 0)},
                                                   {Vec3(-0.125, 0.25, 0), Vec3(0.125, -0.25, 0)}}};
  for (const auto& [from, to] : ways) {
    for (const int steps : {1000, 1024, 4096}) {
      const Way way = led(compiled, Pose::Identity(), from, to, 1e-3, steps);
      EXPECT_EQ(way.deepest_m, 0.0) << from.transpose() << ", " << steps;
      EXPECT_LE(way.off_m, 1e-12) << from.transpose() << ", " << steps;
    }
  }
}

// A brick bond: the ends of one row meet the middle of the next.
TEST(Seams, APointSlidesOverBricks) {
  std::vector<Object> bricks;
  for (int row = 0; row < 4; ++row) {
    for (int i = 0; i < 4; ++i) {
      BoxShape box;
      box.pose_W.translation() = Vec3(0.2 * i + 0.1 * (row % 2), 0.1 * row, -0.05);
      box.size_m = Vec3(0.2, 0.1, 0.1);
      bricks.push_back(object(box));
    }
  }
  scenes::CompiledScene compiled = compile(scene_of(bricks));
  for (int line = 0; line < 60; ++line) {
    const Vec3 from(0.05 + 0.009 * line, 0.0, 0.0), to(0.6 - 0.008 * line, 0.3, 0.0);
    const Way way = led(compiled, Pose::Identity(), from, to, 0.02, 700);
    EXPECT_LE(way.deepest_m, 1e-12) << line;
    EXPECT_LE(way.off_m, 1e-9) << line;
  }
}

// Pushed along a table against what stands on it: it stops at the foot, and goes neither below nor through.
TEST(Seams, NothingPassesBelowWhatStandsOnATable) {
  BoxShape table, box;
  table.pose_W.translation() = Vec3(0, 0, -0.05);
  table.size_m = Vec3(1, 1, 0.1);
  box.pose_W.translation() = Vec3(0, 0, 0.05);
  box.size_m = Vec3(0.2, 0.2, 0.1);
  const CylinderShape post{Vec3(0, 0, 0), Vec3(0, 0, 0.1), 0.1};
  const PlaneShape plane{Vec3::Zero(), Vec3::UnitZ()};
  for (const double off_m : {0.0, 1e-7, -1e-7, 1e-6}) {
    BoxShape raised = box;
    raised.pose_W.translation().z() += off_m;
    CylinderShape raised_post = post;
    raised_post.from_m.z() += off_m;
    const std::vector<std::vector<Object>> scenes{{object(table), object(raised)},
                                                  {object(plane), object(raised)},
                                                  {object(table), object(raised_post)},
                                                  {object(raised_post), object(plane)}};
    for (std::size_t n = 0; n < scenes.size(); ++n) {
      scenes::CompiledScene compiled = compile(scene_of(scenes[n]));
      auto& g = compiled.algorithm<3>();
      for (const double press_m : {1e-6, 1e-3, 0.02}) {
        Vec3 q(-0.3, 0.01, 0.0);
        for (int k = 0; k <= 600; ++k) q = g(K, Vec3(-0.3 + 1e-3 * k, 0.01, -press_m), q);
        EXPECT_LE(q.x(), n < 2 ? -0.1 + 1e-9 : 0.3 + 1e-9) << n << ", " << off_m << ", " << press_m;
        EXPECT_TRUE(n < 2 || std::hypot(q.x(), q.y()) >= 0.1 - 1e-9) << n << ", " << off_m << ", " << press_m;
        EXPECT_GE(q.z(), -1e-9) << n << ", " << off_m << ", " << press_m;
      }
    }
  }
}

// Along the mantle of cylinders that stand on one another, pushed inwards.
TEST(Seams, APointSlidesOverStackedCylinders) {
  std::mt19937 chance(3);
  for (const double step_m : {0.0, 1e-7, 9e-7}) {
    const Pose frame = turned(chance);
    std::vector<Object> stack;
    for (int i = 0; i < 4; ++i) {
      stack.push_back(object(
          CylinderShape{frame * Vec3(0, 0, 0.1 * i), frame * Vec3(0, 0, 0.1 * (i + 1)), 0.05 + step_m * (i % 2)}));
    }
    scenes::CompiledScene compiled = compile(scene_of(stack));
    auto& g = compiled.algorithm<3>();
    for (const double depth_m : {1e-6, 1e-3, 0.02}) {
      Vec3 q = frame * Vec3(0.06, 0, 0.02);
      for (int k = 0; k <= 800; ++k) {
        q = g(K, frame * Vec3(0.05 - depth_m, 0.0, 0.02 + 0.36 * k / 800), q);
        ASSERT_GE((frame.inverse() * q).head<2>().norm(), 0.05 - 1e-12) << step_m << ", " << depth_m << ", " << k;
      }
      EXPECT_NEAR((frame.inverse() * q).z(), 0.38, 1e-6) << step_m << ", " << depth_m;
    }
  }
}

// What moves, what is seen from inside, what is further apart and what is turned stays as it is.
TEST(Seams, NothingElseIsJoined) {
  BoxShape box, beside;
  beside.pose_W.translation() = Vec3(1, 0, 0);
  EXPECT_EQ(scenes::join(scene_of({object(box), object(beside)})).seams.size(), 1u);
  BoxShape apart = beside;
  apart.pose_W.translation().x() += 2e-6;
  EXPECT_TRUE(scenes::join(scene_of({object(box), object(apart)})).seams.empty());
  BoxShape skew = beside;
  skew.pose_W.linear() = Eigen::AngleAxisd(1e-5, Vec3::UnitX()).toRotationMatrix();
  EXPECT_TRUE(scenes::join(scene_of({object(box), object(skew)})).seams.empty());
  BoxShape room = beside;
  room.inside_out = true;
  EXPECT_TRUE(scenes::join(scene_of({object(box), object(room)})).seams.empty());
  Object moving = object(beside);
  moving.motion = scenes::Motion{};
  EXPECT_TRUE(scenes::join(scene_of({object(box), moving})).seams.empty());
  Object soft = object(beside);
  soft.layer = scenes::ElasticLayer{0.01, 1000.0};
  EXPECT_TRUE(scenes::join(scene_of({object(box), soft})).seams.empty());
}

TEST(Seams, AStepOfLessThanAMicrometreIsTakenOutByTheHigherFace) {
  BoxShape box, beside;
  beside.pose_W.translation() = Vec3(1, 0, 4e-7);
  const scenes::Joined joined = scenes::join(scene_of({object(box), object(beside)}));
  const auto& low = std::get<BoxShape>(joined.objects[0].shape);
  const auto& high = std::get<BoxShape>(joined.objects[1].shape);
  EXPECT_DOUBLE_EQ(low.pose_W.translation().z() + 0.5 * low.size_m.z(), 0.5 + 4e-7);
  EXPECT_DOUBLE_EQ(high.pose_W.translation().z() + 0.5 * high.size_m.z(), 0.5 + 4e-7);
  EXPECT_DOUBLE_EQ(high.pose_W.translation().z() - 0.5 * high.size_m.z(), -0.5);
}

}  // namespace
}  // namespace proxarm::tests
