// A guide that leads into objects: the proxy runs along it and stops at them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "models/description/setup_error.hpp"
#include "scenes/check.hpp"
#include "scenes/compile.hpp"
#include "scenes/scene_file.hpp"
#include "tests/allocation_count.hpp"
#include "tests/models/random_states.hpp"

namespace proxarm::tests {
namespace {

using models::Vec3;
using scenes::compile;
using scenes::parse_scene;
using scenes::Scene;

const std::string along_x = "guide: {line: {point_m: [0, 0, 0], direction: [1, 0, 0], friction: 0.2}}\n";
const std::string on_floor = "guide: {plane: {point_m: [0, 0, 0], normal: [0, 0, 1], friction: 0.2}}\n";
const std::string around = "guide: {polyline: {points_m: [[0, 0, 0], [1, 0, 0], [1, 1, 0]], friction: 0.1}}\n";

struct Case {
  std::string name, object;
  double stop_x;  // of a proxy that comes along x from the origin
};
std::vector<Case> cases() {
  return {{"plane", "plane: {point_m: [0.5, 0, 0], normal: [-1, 0, 0.5], friction: 0.3}", 0.5},
          {"box", "box: {centre_m: [0.6, 0, 0.1], size_m: [0.2, 0.2, 0.3], friction: 0.3}", 0.5},
          {"sphere", "sphere: {centre_m: [0.6, 0.06, 0], radius_m: 0.1, friction: 0.3}", 0.52},
          {"sphere from inside", "sphere: {centre_m: [0.2, 0, 0], radius_m: 0.3, inside_out: true}", 0.5},
          {"capsule", "capsule: {from_m: [0.6, -1, 0], to_m: [0.6, 1, 0], radius_m: 0.1}", 0.5},
          {"cylinder", "cylinder: {from_m: [0.6, 0, -1], to_m: [0.6, 0, 1], radius_m: 0.1, friction: 0.3}", 0.5},
          {"room", "box: {centre_m: [0.2, 0, 0], size_m: [0.6, 0.6, 0.6], inside_out: true, friction: 0.1}", 0.5}};
}

TEST(GuideAmongObjects, RunsAlongALineAndStops) {
  for (const Case& c : cases()) {
    const auto world = compile(parse_scene("objects:\n  - " + c.object + "\n" + along_x, "guide.yaml"));
    auto& g = world.algorithm<3>();
    // In one step from far off, however hard it is pushed, and in small ones.
    for (const double far : {0.6, 0.75, 2.0, 100.0}) {
      EXPECT_NEAR(g(1e6, Vec3(far, 0, 0), Vec3::Zero()).x(), c.stop_x, 1e-12) << c.name;
      ASSERT_EQ(g.contacts().size(), 2u) << c.name;
      EXPECT_EQ(g.contacts()[0].object, 1);
      EXPECT_EQ(g.contacts()[1].object, 0);
      EXPECT_LT(g.contacts()[1].normal.x(), -0.1) << c.name;
    }
    Vec3 q = Vec3::Zero();
    for (int k = 0; k < 2000; ++k) q = g(1e6, q + Vec3(1e-3, 2e-4, -1e-4), q);
    EXPECT_LE((q - Vec3(c.stop_x, 0, 0)).norm(), 1e-12) << c.name;
    // It stays bit for bit, and leaves when it is drawn back by more than the guide's friction.
    for (int k = 0; k < 100; ++k) ASSERT_EQ(g(1e6, q + Vec3(1e-5, 1e-5, 0), q), q) << c.name;
    EXPECT_EQ(g(1e6, q + Vec3(-1e-6, 1e-5, 0), q), q) << "the guide's friction holds it";
    EXPECT_NEAR(g(1e6, q + Vec3(-1e-5, 1e-5, 0), q).x() - q.x(), -8e-6, 1e-15);
  }
}

TEST(GuideAmongObjects, TurnsACornerAndStops) {
  const auto world =
      compile(parse_scene("objects:\n  - sphere: {centre_m: [1, 0.5, 0], radius_m: 0.1}\n" + around, "guide.yaml"));
  auto& g = world.algorithm<3>();
  EXPECT_LE((g(1e6, Vec3(1.5, 0.45, 0), Vec3(0.2, 0, 0)) - Vec3(1, 0.4, 0)).norm(), 1e-12);
  EXPECT_LE((g(1e6, Vec3(1.5, 0.2, 0), Vec3(0.2, 0, 0)) - Vec3(1, 0.15, 0)).norm(), 1e-12) << "friction of the guide";
  EXPECT_LE((g(1e6, Vec3(0.9, 0.45, 0), Vec3(1, 0.9, 0)) - Vec3(1, 0.6, 0)).norm(), 1e-12) << "from beyond";
}

// On a plane it has a way around: it slides along objects, with the friction of both.
TEST(GuideAmongObjects, SlidesAlongAWallOnAPlane) {
  const auto world = compile(parse_scene(
      "objects:\n  - plane: {point_m: [0.5, 0, 0], normal: [-1, 0, 0], friction: 0.3}\n" + on_floor, "g.yaml"));
  auto& g = world.algorithm<3>();
  // 10 across the guide and 20 into the wall bear 0.2 · 10 + 0.3 · 20 = 8 along both.
  EXPECT_LE((g(1.0, Vec3(20.5, 9, 10), Vec3(0.5, 0, 0)) - Vec3(0.5, 1, 0)).norm(), 1e-13);
  EXPECT_EQ(g.contacts().size(), 2u);
  EXPECT_EQ(g(1.0, Vec3(20.5, 7.9, 10), Vec3(0.5, 0, 0)), Vec3(0.5, 0, 0));
  EXPECT_LE((g(1.0, Vec3(0.3, 3, -10), Vec3(0.3, 0, 0)) - Vec3(0.3, 1, 0)).norm(), 1e-14);
  EXPECT_EQ(g.contacts().size(), 1u);
}

// An object that moves takes the proxy along on the plane.
TEST(GuideAmongObjects, IsPushedOnAPlane) {
  const auto world = compile(parse_scene(
      "objects:\n  - sphere: {centre_m: [-0.2, 0.01, 0.03], radius_m: 0.1, motion: {velocity_m_per_s: [1, 0, 0]}}\n" +
          on_floor,
      "g.yaml"));
  auto& g = world.algorithm<3>();
  Vec3 q = Vec3::Zero();
  for (int k = 1; k <= 300; ++k) {
    g.set_time({.time_s = 1e-3 * k, .period_s = 1e-3});
    q = g(1e6, q, q);
    ASSERT_LE(std::abs(q.z()), 1e-12);
    ASSERT_GE((q - Vec3(-0.2 + 1e-3 * k, 0.01, 0.03)).norm(), 0.1 - 1e-12) << k;
  }
  EXPECT_EQ(g.unresolved_steps(), 0u);
}

// Assumption 1, rests, repeatable.
TEST(GuideAmongObjects, KeepsTheContract) {
  for (const std::string& guide : {along_x, on_floor, around}) {
    for (const Case& c : cases()) {
      const Scene scene =
          parse_scene("objects:\n  - " + c.object + "\n  - sphere: {centre_m: [-0.5, 0, 0], radius_m: 0.1}\n" + guide,
                      "guide.yaml");
      for (const auto& report : scenes::check_scene(scene, {.states = 3000})) {
        EXPECT_TRUE(report.passed()) << c.name << ", " << guide << report.text();
        EXPECT_GT(report.in_contact, 100) << c.name;
      }
    }
  }
}

// From anywhere on the guide, by any p: never inside, never off the guide, nothing allocated.
TEST(GuideAmongObjects, NeverEntersAnything) {
  Random random(841);
  for (const std::string& guide : {along_x, on_floor, around}) {
    for (const Case& c : cases()) {
      const Scene scene = parse_scene("objects:\n  - " + c.object + "\n" + guide, "guide.yaml");
      const auto world = compile(scene);
      auto& g = world.algorithm<3>();
      Vec3 q = Vec3::Zero();
      const std::uint64_t before = allocation_count();
      std::size_t stopped = 0;
      double least = 1.0, off = 0.0;
      // Fewer don't meet everything often enough to tell.
      const std::int64_t steps = std::max(scaled(20'000), std::int64_t{20'000});
      for (std::int64_t i = 0; i < steps; ++i) {
        q = g(1e6, q + random.log_uniform(1e-9, 1.0) * random.direction<3>() + Vec3(1e-5, 0, 0), q);
        off = std::max(off, std::abs(q.z()));
        if (i % 4 == 0) least = std::min(least, scenes::clearance_m(scene, q));
        stopped += g.contacts().size() > 1 ? 1 : 0;
        if (q.norm() > 2.0) q = Vec3::Zero();
      }
      EXPECT_TRUE(!allocations_are_counted() || allocation_count() == before) << "allocated";
      EXPECT_GE(least, -1e-12) << c.name << ", " << guide;
      EXPECT_LE(off, 1e-12) << c.name << ", " << guide;
      EXPECT_GT(stopped, 10u) << c.name << ", " << guide;
      // On a plane, a metre-long step can be deeper than a ball is wide; then a shorter one is taken.
      EXPECT_LE(g.unresolved_steps(), guide == on_floor ? static_cast<std::uint64_t>(steps / 1000) : 0u)
          << c.name << ", " << guide;
    }
  }
}

TEST(GuideAmongObjects, RefusesWhatHasNoMeaning) {
  const auto refused = [](const std::string& text) {
    try {
      compile(parse_scene(text, "guide.yaml"));
    } catch (const description::SetupError& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  const std::string ball = "objects:\n  - sphere: {centre_m: [1, 0, 0], radius_m: 0.1, ";
  EXPECT_THAT(refused(ball + "motion: {velocity_m_per_s: [1, 0, 0]}}\n" + along_x), testing::HasSubstr("that moves"));
  EXPECT_THAT(refused(ball + "layer: {thickness_m: 0.01, stiffness_N_per_m: 1000}}\n" + along_x),
              testing::HasSubstr("elastic layer beside a guide along a line"));
  EXPECT_EQ(refused(ball + "layer: {thickness_m: 0.01, stiffness_N_per_m: 1000}}\n" + on_floor), "accepted");
}

}  // namespace
}  // namespace proxarm::tests
