// Tools in hollow objects: the farthest point of a tool from the middle tells how near it is.
#include <gtest/gtest.h>

#include <numbers>

#include "models/base/random.hpp"
#include "models/rigid/rigid_world.hpp"
#include "tests/models/rigid/rigid_judge.hpp"

namespace proxarm::models {
namespace {

using Room = decltype(RigidObject::shape);

// Points with a radius whose hull is the tool: they are farthest in any convex room.
struct Tips {
  std::vector<Vec3> points;
  double radius = 0.0;
};

Tips tips_of(const BoxTool& box) { return {polyhedron_of_box(box.size_m, Pose::Identity()).corners, 0.0}; }
Tips tips_of(const CapsuleTool& capsule) {
  return {{Vec3(0.0, 0.0, -0.5 * capsule.length_m), Vec3(0.0, 0.0, 0.5 * capsule.length_m)}, capsule.radius_m};
}
Tips tips_of(const SphereTool& sphere) { return {{Vec3::Zero()}, sphere.radius_m}; }
// Of the rims a thousand places: between them a rim stands out by less than the square of half a place's angle.
Tips tips_of(const CylinderTool& cylinder) {
  Tips tips;
  for (int k = 0; k < 2000; ++k) {
    const double angle = std::numbers::pi / 500.0 * k;
    tips.points.emplace_back(cylinder.radius_m * std::cos(angle), cylinder.radius_m * std::sin(angle),
                             (k % 2 == 0 ? 0.5 : -0.5) * cylinder.length_m);
  }
  return tips;
}

double room_in(const std::vector<Room>& rooms, const Vec3& p) {
  double least = 1.0;
  for (const Room& room : rooms) {
    if (const auto* side = std::get_if<FlatSide>(&room)) least = std::min(least, side->normal.dot(p) - side->offset);
    if (const auto* ball = std::get_if<HollowSphere>(&room)) {
      least = std::min(least, ball->radius - (p - ball->centre).norm());
    }
    if (const auto* tube = std::get_if<HollowTube>(&room)) {
      const Vec3 along = tube->to - tube->from;
      double s = along.dot(p - tube->from) / along.squaredNorm();
      if (!tube->endless) s = std::clamp(s, 0.0, 1.0);
      least = std::min(least, tube->radius - (p - tube->from - s * along).norm());
    }
  }
  return least;
}

std::vector<Room> hollow_sphere() { return {HollowSphere{{0.01, 0.0, 0.0}, 0.06}}; }
std::vector<Room> hollow_capsule() { return {HollowTube{{0.0, 0.0, -0.03}, {0.01, 0.0, 0.04}, 0.05, false}}; }
std::vector<Room> hollow_cylinder() {
  const Vec3 e = Vec3(0.1, -0.2, 1.0).normalized();
  return {HollowTube{-0.05 * e, 0.05 * e, 0.05, true}, FlatSide{-e, -0.05}, FlatSide{e, -0.05}};
}
std::vector<Room> hollow_box() {
  std::vector<Room> sides;
  const Mat3 R = Eigen::AngleAxisd(0.7, Vec3(1.0, 2.0, -1.0).normalized()).toRotationMatrix();
  for (int k = 0; k < 3; ++k) {
    sides.emplace_back(FlatSide{R.col(k), -0.05});
    sides.emplace_back(FlatSide{Vec3(-R.col(k)), -0.06});
  }
  return sides;
}

template <typename Shape>
void expect_held(const Shape& shape, const std::vector<Room>& rooms) {
  const Tips tips = tips_of(shape);
  Pushed out;
  for (std::uint64_t world = 0; world < 10; ++world) {
    Random random(700 + world);
    std::vector<RigidObject> objects;
    for (const Room& room : rooms) {
      RigidObject object;
      object.shape = room;
      object.friction = 0.1 * static_cast<double>(world % 5);
      objects.push_back(std::move(object));
    }
    RigidWorld g({{{shape, Pose::Identity(), {}}}}, std::move(objects));
    const auto apart = [&](const ToolPose& pose) {
      double least = 1.0;
      for (const Vec3& tip : tips.points) least = std::min(least, room_in(rooms, pose * tip) - tips.radius);
      return least;
    };
    Mat6 K = Mat6::Zero();
    K.diagonal() << Vec3::Constant(4e6), Vec3::Constant(4e3);
    ToolPose q;
    q.orientation = rotation_by(random.arrow(0.0, 3.0));
    push_about(g, random, q, K, {0.1 * static_cast<double>(world % 5)}, 300, Vec3::Zero(), true, apart, out);
  }
  expect_law(out);
}

TEST(RigidWorldsInside, ASphereKeepsTheLaw) {
  for (const auto& rooms : {hollow_sphere(), hollow_capsule(), hollow_cylinder(), hollow_box()}) {
    SCOPED_TRACE(rooms.front().index());
    expect_held(SphereTool{0.01}, rooms);
  }
}

TEST(RigidWorldsInside, ACapsuleKeepsTheLaw) {
  for (const auto& rooms : {hollow_sphere(), hollow_capsule(), hollow_cylinder(), hollow_box()}) {
    SCOPED_TRACE(rooms.front().index());
    expect_held(CapsuleTool{0.03, 0.004}, rooms);
  }
}

TEST(RigidWorldsInside, ABoxKeepsTheLaw) {
  for (const auto& rooms : {hollow_sphere(), hollow_capsule(), hollow_cylinder(), hollow_box()}) {
    SCOPED_TRACE(rooms.front().index());
    expect_held(BoxTool{{0.02, 0.03, 0.025}}, rooms);
  }
}

TEST(RigidWorldsInside, ACylinderKeepsTheLaw) {
  for (const auto& rooms : {hollow_sphere(), hollow_capsule(), hollow_cylinder(), hollow_box()}) {
    SCOPED_TRACE(rooms.front().index());
    expect_held(CylinderTool{0.03, 0.01}, rooms);
  }
}

}  // namespace
}  // namespace proxarm::models
