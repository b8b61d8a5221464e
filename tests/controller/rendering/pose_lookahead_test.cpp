// The place to which a tool with a shape is sent ahead: where the tool goes if it coasts, by single steps; and never
// inside an object, by formulas of this file alone.
#include "controller/rendering/pose_lookahead.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <random>
#include <string>

#include "controller/rendering/pose_world.hpp"
#include "scenes/format/scene_file.hpp"
#include "scenes/rigid/compile_rigid.hpp"
#include "tests/allocation_count.hpp"

namespace proxarm::controller {
namespace {

using models::Vec3;

constexpr double T = 1e-3, kg = 4.0, radius_m = 0.03;
constexpr double rounding_m = 1e-12;  // positions of up to a metre, some tens of operations a step

const std::string ball = "tool: {parts: [{sphere: {radius_m: 0.03}}]}\n";

struct World {
  explicit World(const std::string& objects, PoseConfig proxy = {}, bool looks_ahead = true)
      : scene(scenes::compile(scenes::parse_scene(ball + objects, "ahead.yaml"))) {
    proxy.mass_kg = kg;
    proxy.held = true;
    proxy.period_s = T;
    PoseWorldConfig config;
    config.proxy = proxy;
    config.looks_ahead = looks_ahead;
    world = std::make_unique<PoseWorld>(scenes::compile_rigid(*scene.source, scene.source->tool->shape), scene, config);
    world->start(Vec3::Zero());
  }
  Vec3 step(const Vec3& h_W) {
    limits.q_k1_W = q;
    const WorldStep step = world->step(h_W, limits);
    EXPECT_EQ(step.fault, ProxyFault::none);
    return q = step.q_W;
  }
  Vec3 ahead(double horizon_s) { return world->look_ahead(Vec3::Zero(), limits, horizon_s); }

  scenes::CompiledScene scene;
  std::unique_ptr<PoseWorld> world;
  StepLimits limits;
  Vec3 q = Vec3::Zero();
};

// A hand that pushes this way and that, another way each 40 ms.
Vec3 force(int k) {
  const int turn = k / 40;
  const double phase = 0.7 * turn;
  return {12.0 * std::sin(phase) + 6.0, 9.0 * std::cos(1.3 * phase), 4.0 * std::sin(2.1 * phase)};
}

// Moves one world by the hand, and a second one by the same hand until `at` and without it from there on. Returns by
// how much the prediction at `at` misses the second world `steps` later, m.
double miss_m(const std::string& objects, const PoseConfig& proxy, int at, int steps) {
  World led(objects, proxy), coasting(objects, proxy, false);
  for (int k = 0; k < at; ++k) {
    led.step(force(k));
    coasting.step(force(k));
  }
  const Vec3 predicted = led.ahead(steps * T);
  for (int k = 0; k < steps; ++k) coasting.step(Vec3::Zero());
  return (predicted - coasting.q).norm();
}

TEST(PoseLookahead, InFreeSpaceTheToolGoesWhereItCoastsWithDampingAndSpring) {
  PoseConfig damped;
  damped.damping_Ns_per_m = 30.0;
  damped.spring_N_per_m = 200.0;
  for (const PoseConfig& proxy : {PoseConfig{}, damped}) {
    for (const int at : {1, 77, 400}) {
      for (const int steps : {1, 8, 17}) EXPECT_LT(miss_m("objects: []\n", proxy, at, steps), rounding_m);
    }
  }
}

TEST(PoseLookahead, AHorizonBetweenTwoStepsIsInterpolated) {
  World world("objects: []\n");
  for (int k = 0; k < 100; ++k) world.step(force(k));
  const Vec3 three = world.ahead(3 * T), four = world.ahead(4 * T);
  EXPECT_LT((world.ahead(3.25 * T) - (three + 0.25 * (four - three))).norm(), rounding_m);
  EXPECT_EQ(world.ahead(0.0), world.q);
}

TEST(PoseLookahead, AlongAWallTheToolIsSentWhereSingleStepsLead) {
  // A smooth wall takes the same from a velocity in one step as in many. A rough one takes up to μ times the speed of
  // the impact, which single steps do a period later at most: μ v T, with less than 0.5 m/s.
  const std::string wall = "objects:\n  - plane: {name: wall, point_m: [0.05, 0, 0], normal: [-1, 0, 0]";
  for (const int at : {60, 95, 120, 200, 333}) {
    for (const int steps : {5, 12}) {
      EXPECT_LT(miss_m(wall + "}\n", {}, at, steps), rounding_m) << at;
      EXPECT_LT(miss_m(wall + ", friction: 0.3}\n", {}, at, steps), 0.3 * 0.5 * T) << at;
    }
  }
}

// The ball in front of a plane and a box that swings through its place; distances by hand.
TEST(PoseLookahead, TheToolIsNeverSentIntoAnObject) {
  const std::string objects =
      "objects:\n"
      "  - plane: {name: wall, point_m: [0.05, 0, 0], normal: [-1, 0, 0], friction: 0.4}\n"
      "  - box:\n"
      "      name: sweeper\n"
      "      centre_m: [0, -0.2, 0]\n"
      "      size_m: [0.4, 0.2, 0.4]\n"
      "      motion: {swing: {amplitude_m: [0, 0.05, 0], frequency_Hz: 1.5}}\n";
  std::mt19937_64 generator(11);
  std::printf("seed 11\n");
  std::uniform_real_distribution<double> push(-40.0, 40.0), horizon(0.001, 0.02);
  World world(objects);
  Vec3 h_W = Vec3::Zero();
  int pressed = 0;
  for (int k = 1; k <= 5000; ++k) {
    if (k % 50 == 1) h_W = {push(generator), push(generator), 0.0};
    const Vec3 centring = -100.0 * world.q;  // keeps the ball where the objects are
    world.step(h_W + centring);
    const double horizon_s = horizon(generator);
    const Vec3 ahead = world.ahead(horizon_s);
    const double face_y = -0.1 + 0.05 * std::sin(2.0 * M_PI * 1.5 * (k * T + horizon_s));
    const double to_wall = 0.05 - radius_m - ahead.x(), to_box = ahead.y() - radius_m - face_y;
    ASSERT_GT(to_wall, -1e-9) << k;
    ASSERT_GT(to_box, -1e-9) << k;
    pressed += to_wall < 1e-9 || to_box < 1e-9 ? 1 : 0;
  }
  EXPECT_GT(pressed, 500) << "the test would tell nothing";
}

TEST(PoseLookahead, APredictionChangesNothingInTheProxysWorld) {
  const std::string objects =
      "objects:\n  - box: {name: block, centre_m: [0.1, 0, 0], size_m: [0.1, 0.3, 0.3], friction: 0.3}\n";
  World looking(objects), plain(objects, {}, false);
  for (int k = 0; k < 800; ++k) {
    const Vec3 q = looking.step(force(k));
    ASSERT_EQ(q, plain.step(force(k))) << k;
    looking.ahead(0.012);
  }
}

TEST(PoseLookahead, ABordersPlaneHoldsThePredictionAsItHoldsTheSteps) {
  // The bound of a step falls by a quarter of each step towards the border, as of a border 20 mm away.
  constexpr double share = 0.25, border_m = 0.02;
  World led("objects: []\n"), coasting("objects: []\n", {}, false);
  const auto limit = [&](World& world) {
    world.limits.plane_count = 1;
    world.limits.planes[0].normal = Vec3::UnitX();
    world.limits.planes[0].share = share;
    world.limits.planes[0].bound_m = share * (border_m - world.q.x());
    world.limits.planes[0].limits = ActiveLimits::of(Limit::workspace);
  };
  for (int k = 0; k < 60; ++k) {
    limit(led);
    led.step({30.0, 5.0, 0.0});
    limit(coasting);
    coasting.step({30.0, 5.0, 0.0});
  }
  const Vec3 predicted = led.ahead(10 * T);
  EXPECT_LT(predicted.x(), border_m);
  for (int k = 0; k < 10; ++k) {
    limit(coasting);
    coasting.step(Vec3::Zero());
  }
  EXPECT_LT((predicted - coasting.q).norm(), 1e-9);
}

TEST(PoseLookahead, AChangedFrictionActsInThePrediction) {
  // The ball meets the wall at 45° within the horizon: with μ = 2 it sticks there, without friction it slides on.
  const auto wall = [](const std::string& friction) {
    return "objects:\n  - plane: {name: wall, point_m: [0.0302, 0, 0], normal: [-1, 0, 0], friction: " + friction +
           "}\n";
  };
  const auto way_along_m = [](World& world) {
    for (int k = 0; k < 5; ++k) world.step({20.0, 20.0, 0.0});
    return world.ahead(0.02).y() - world.q.y();
  };
  World rough(wall("0.0001"));
  rough.world->set({.parameter = Parameter::friction, .value = 2.0, .object = 0});
  for (int k = 0; k < 2500; ++k) rough.step(Vec3::Zero());  // friction rises by 1 a second
  World smooth(wall("0.0001"));
  EXPECT_GT(way_along_m(smooth), 4e-4);  // 0.025 m/s for 20 ms
  EXPECT_LT(way_along_m(rough), 2e-4);   // no further than to where it meets the wall
}

TEST(PoseLookahead, NothingIsAllocated) {
  if (!tests::allocations_are_counted()) GTEST_SKIP() << "not under sanitizers";
  World world(
      "objects:\n  - box: {name: lift, centre_m: [0.1, 0, 0], size_m: [0.1, 0.3, 0.3], friction: 0.3,\n"
      "          motion: {swing: {amplitude_m: [0.02, 0, 0], frequency_Hz: 2}}}\n");
  world.step(force(0));
  world.ahead(0.01);
  const std::uint64_t before = tests::allocation_count();
  for (int k = 1; k < 400; ++k) {
    world.step(force(k));
    world.ahead(0.01);
  }
  EXPECT_EQ(tests::allocation_count(), before);
}

}  // namespace
}  // namespace proxarm::controller
