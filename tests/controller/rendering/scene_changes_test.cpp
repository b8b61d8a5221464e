// What a change does to a scene, as the scene's 𝒢 shows it: no step of friction, no step of place.
#include "controller/rendering/scene_changes.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>

#include "scenes/format/scene_file.hpp"

namespace proxarm::controller {
namespace {

using models::Vec3;

constexpr double T = 1e-3;
constexpr std::int32_t table = 0, plate = 1, smooth = 2;

// A table with friction; a plate without, which can be driven; a ball far away that can neither rub nor be driven.
scenes::CompiledScene scene() {
  return scenes::compile(scenes::parse_scene(
      "objects:\n"
      "  - plane: {name: table, point_m: [0, 0, 0], normal: [0, 0, 1], friction: 0.2}\n"
      "  - box: {name: plate, centre_m: [0.55, 0, 0.5], size_m: [0.1, 0.2, 0.2], motion: {driven: true}}\n"
      "  - sphere: {name: smooth, centre_m: [0, 9, 9], radius_m: 0.1}\n",
      "changes.yaml"));
}

Change friction_of(std::int32_t object, double mu) {
  return {.parameter = Parameter::friction, .value = mu, .object = object};
}
Change position_of(std::int32_t object, const Vec3& position_m) {
  return {.parameter = Parameter::position,
          .object = object,
          .position_m = {position_m.x(), position_m.y(), position_m.z()}};
}

class SceneChangesTest : public ::testing::Test {
 protected:
  // How far friction holds back a slide of 2 mm with 1 mm of indentation: μ times the indentation, at most the slide.
  double friction_felt() {
    const Vec3 q = world.algorithm<3>()(1e6, Vec3(0.002, -3.0, -0.001), Vec3(0.0, -3.0, 0.0));
    return (0.002 - q.x()) / 0.001;
  }
  // Where the plate's face that looks to −x stops a proxy that is pushed into it, less where it is described.
  double plate_felt_m() {
    auto& g = world.algorithm<3>();
    return g(1e6, Vec3(0.7, 0.0, 0.5), Vec3(0.3, 0.0, 0.5)).x() - 0.5;
  }

  scenes::CompiledScene world = scene();
  SceneChanges changes{world, T};
};

TEST_F(SceneChangesTest, NothingChangesUnasked) {
  EXPECT_EQ(changes.friction(table), 0.2);
  EXPECT_EQ(changes.position_m(plate), Vec3(Vec3::Zero()));
  for (int k = 0; k < 10; ++k) changes.step();
  EXPECT_EQ(changes.friction(table), 0.2);
  EXPECT_EQ(changes.position_m(plate), Vec3(Vec3::Zero()));
  EXPECT_NEAR(friction_felt(), 0.2, 1e-12);
}

TEST_F(SceneChangesTest, FrictionGoesToItsValueAtARateAndStaysThere) {
  for (const double wanted : {0.3, 0.05}) {
    const double from = changes.friction(table), steps = std::abs(wanted - from) / (SceneChanges::friction_per_s * T);
    changes.set(friction_of(table, wanted));
    EXPECT_EQ(changes.friction(table), from) << "not before the next step";
    double before = from;
    for (int k = 1; k <= 400; ++k) {
      changes.step();
      const double now = changes.friction(table);
      ASSERT_LE(std::abs(now - before), SceneChanges::friction_per_s * T * (1.0 + 1e-12)) << "a step of force";
      ASSERT_NEAR(friction_felt(), now, 1e-12) << "the scene renders what is said";
      if (k > steps + 1.0) {
        ASSERT_EQ(now, wanted) << "exactly, after " << k << " steps";
      }
      before = now;
    }
  }
}

TEST_F(SceneChangesTest, ANewWishReplacesTheOneUnderWay) {
  changes.set(friction_of(table, 1.0));
  for (int k = 0; k < 50; ++k) changes.step();
  EXPECT_NEAR(changes.friction(table), 0.25, 1e-12);
  changes.set(friction_of(table, 0.24));
  for (int k = 0; k < 11; ++k) changes.step();
  EXPECT_EQ(changes.friction(table), 0.24);
}

// v(k) = min(v(k−1) + aT, v_max, √(2ad)): neither the speed nor its rise ever exceeds what the header promises, and the
// object ends on the spot. On 0.1 m it reaches its full speed.
TEST_F(SceneChangesTest, ADrivenObjectMovesStraightWithinItsSpeedAndAcceleration) {
  const Vec3 wanted(-0.06, 0.08, 0.0);
  changes.set(position_of(plate, wanted));
  Vec3 before = Vec3::Zero();
  double speed = 0.0, fastest = 0.0;
  int arrived = 0;
  for (int k = 1; k <= 3000 && arrived == 0; ++k) {
    changes.step();
    const Vec3 now = changes.position_m(plate);
    const double v = (now - before).norm() / T;
    ASSERT_LE(v, SceneChanges::speed_m_per_s * (1.0 + 1e-9));
    ASSERT_LE(v, speed + SceneChanges::acceleration_m_per_s2 * T * (1.0 + 1e-9));
    ASSERT_LT(now.cross(wanted).norm(), 1e-15) << "off the straight way";
    ASSERT_LE(now.dot(wanted), wanted.squaredNorm() * (1.0 + 1e-12)) << "beyond the place";
    ASSERT_NEAR(plate_felt_m(), now.x(), 1e-12) << "the scene renders what is said";
    before = now;
    speed = v;
    fastest = std::max(fastest, v);
    if (now == wanted) arrived = k;
  }
  EXPECT_NEAR(fastest, SceneChanges::speed_m_per_s, 1e-9);
  // 1 s at full speed, and 0.1 s for each of speeding up and slowing down.
  EXPECT_NEAR(arrived * T, 1.2, 0.05);
}

// A moving object carries what rests upon it. One that has arrived must not: it was told its last place twice.
TEST_F(SceneChangesTest, AnObjectThatHasArrivedRests) {
  changes.set(position_of(plate, Vec3(-0.01, 0.0, 0.0)));
  for (int k = 0; k < 1000; ++k) changes.step();
  ASSERT_EQ(changes.position_m(plate), Vec3(-0.01, 0.0, 0.0));
  // Inside the face by less than its last step would sweep: at rest, a touching proxy stays where it is.
  auto& g = world.algorithm<3>();
  const Vec3 touching(0.49 - 1e-9, 0.0, 0.5);
  EXPECT_EQ(g(1e6, touching, touching), touching);
}

TEST_F(SceneChangesTest, TheTimestepChangesUnderWayWithoutAChangeOfSpeed) {
  changes.set(position_of(plate, Vec3(-0.1, 0.0, 0.0)));
  for (int k = 0; k < 500; ++k) changes.step();
  changes.set_period(4.0 * T);
  const Vec3 before = changes.position_m(plate);
  changes.step();
  EXPECT_NEAR((changes.position_m(plate) - before).norm(), 4.0 * T * SceneChanges::speed_m_per_s, 1e-12);
}

TEST_F(SceneChangesTest, WhatAnObjectCannotDoChangesNothing) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  constexpr double infinity = std::numeric_limits<double>::infinity();
  for (const double bad : {nan, infinity, -infinity, -0.1}) changes.set(friction_of(table, bad));
  for (const double bad : {nan, infinity}) changes.set(position_of(plate, Vec3(0.1, bad, 0.0)));
  changes.set(position_of(table, Vec3(0.0, 0.0, 1.0)));
  changes.set(position_of(smooth, Vec3(0.0, 0.0, 1.0)));
  for (const std::int32_t nobody : {-1, 3, std::numeric_limits<std::int32_t>::max()}) {
    changes.set(friction_of(nobody, 0.5));
    changes.set(position_of(nobody, Vec3(0.1, 0.0, 0.0)));
    EXPECT_EQ(changes.friction(nobody), 0.0);
    EXPECT_EQ(changes.position_m(nobody), Vec3(Vec3::Zero()));
  }
  changes.set({.parameter = Parameter::mass, .value = 9.0, .object = table});
  for (int k = 0; k < 100; ++k) changes.step();
  EXPECT_EQ(changes.friction(table), 0.2);
  for (const std::int32_t object : {table, plate, smooth}) {
    EXPECT_EQ(changes.position_m(object), Vec3(Vec3::Zero())) << object;
  }
}

// A replay begins in the middle of a change, with a scene as it is described.
TEST_F(SceneChangesTest, GoesOnFromItsArchiveToTheBit) {
  changes.set(friction_of(table, 0.9));
  changes.set(position_of(plate, Vec3(-0.05, 0.02, 0.0)));
  for (int k = 0; k < 300; ++k) changes.step();
  std::array<std::byte, 1024> bytes{};
  auto written = fieldbus::StateArchive::writer(bytes);
  changes.archive(written);
  scenes::CompiledScene other_world = scene();
  SceneChanges copy(other_world, T);
  auto read = fieldbus::StateArchive::reader(std::span<const std::byte>(bytes).first(written.bytes()));
  copy.archive(read);
  ASSERT_TRUE(written.whole() && read.whole());
  const Vec3 p(0.7, 0.01, 0.5), q(0.3, 0.0, 0.5), pressed(0.002, -3.0, -0.001), rests(0.0, -3.0, 0.0);
  for (int k = 0; k < 600; ++k) {
    ASSERT_EQ(copy.friction(table), changes.friction(table));
    ASSERT_EQ(copy.position_m(plate), changes.position_m(plate));
    ASSERT_EQ(other_world.algorithm<3>()(1e6, p, q), world.algorithm<3>()(1e6, p, q)) << k;
    ASSERT_EQ(other_world.algorithm<3>()(1e6, pressed, rests), world.algorithm<3>()(1e6, pressed, rests)) << k;
    changes.step();
    copy.step();
  }
}

}  // namespace
}  // namespace proxarm::controller
