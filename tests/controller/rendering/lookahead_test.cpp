// The point that is predicted is where the proxy goes, in whatever world, if the force stays.
#include "controller/rendering/lookahead.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "controller/rendering/rendered_world.hpp"
#include "scenes/format/scene_file.hpp"
#include "tests/allocation_count.hpp"

namespace proxarm::controller {
namespace {

using models::Vec3;

constexpr double T = 1e-3;
constexpr int steps = 8;
constexpr double horizon_s = steps * T;
// Positions of up to a metre, some ten operations a step.
constexpr double rounding_m = 1e-13;

struct World {
  explicit World(const std::string& objects, int order = 1, bool looks_ahead = true)
      : scene(scenes::compile(scenes::parse_scene(objects, "ahead.yaml"))), world(made(order, looks_ahead)) {}
  [[nodiscard]] std::unique_ptr<RenderedWorld> made(int order, bool looks_ahead) {
    SessionSettings settings;
    settings.order = order;
    settings.looks_ahead = looks_ahead;
    return make_rendered_world(scene, settings, 4.0);
  }
  Vec3 step(const Vec3& h_W) {
    const WorldStep step = world->step(h_W, limits);
    EXPECT_EQ(step.fault, ProxyFault::none);
    return step.q_W;
  }
  Vec3 ahead(const Vec3& h_W, double s = horizon_s) { return world->look_ahead(h_W, limits, s); }

  scenes::CompiledScene scene;
  std::unique_ptr<RenderedWorld> world;
  StepLimits limits;
};

constexpr const char* nothing = "objects: []\n";
constexpr const char* smooth_wall = "objects:\n  - plane: {name: wall, point_m: [0.1, 0, 0], normal: [-1, 0, 0]}\n";
constexpr const char* rough_wall =
    "objects:\n  - plane: {name: wall, point_m: [0.001, 0, 0], normal: [-1, 0, 0], friction: 0.5}\n";
constexpr const char* moving_box =
    "objects:\n"
    "  - box:\n"
    "      name: sweeper\n"
    "      centre_m: [0.11, 0, 0]\n"
    "      size_m: [0.2, 0.4, 0.4]\n"
    "      motion: {swing: {amplitude_m: [0.02, 0, 0], frequency_Hz: 1.5}}\n";

// A hand that pushes this way and that, a different way each 40 ms.
Vec3 force(int k) {
  const int turn = k / 40;
  const double phase = 0.7 * turn;
  return {12.0 * std::sin(phase) + 6.0, 9.0 * std::cos(1.3 * phase), 4.0 * std::sin(2.1 * phase)};
}

// What is predicted in each 40th step is where that many steps under the same force lead.
void expect_future(World& at, int cycles) {
  at.world->start(Vec3::Zero());
  Vec3 predicted = Vec3::Zero();
  for (int k = 0; k < cycles; ++k) {
    const Vec3 q = at.step(force(k));
    if (k % 40 == 20) predicted = at.ahead(force(k));
    if (k % 40 == 20 + steps) {
      ASSERT_LT((q - predicted).norm(), rounding_m) << "step " << k;
    }
  }
}

TEST(Lookahead, FreeFlightIsTheExactParabola) {
  World free(nothing);
  free.world->start(Vec3(0.1, 0.2, 0.3));
  const Vec3 h(3.0, -2.0, 1.0), a = h / 4.0;
  for (int k = 1; k <= 300; ++k) {
    free.step(h);
    for (const double s : {0.0, horizon_s}) {
      const double t = k * T + s;
      // 308 differences of differences: ½ 308² roundings of 6e-17 m. Two equal points before the force sets in are a
      // velocity of ½Ta at the start.
      ASSERT_LT((free.ahead(h, s) - (Vec3(0.1, 0.2, 0.3) + 0.5 * T * t * a + 0.5 * t * t * a)).norm(), 5e-12);
    }
  }
}

TEST(Lookahead, GoesStraightBetweenTwoSteps) {
  World free(nothing);
  free.world->start(Vec3::Zero());
  const Vec3 h(3.0, -2.0, 1.0);
  for (int k = 0; k < 50; ++k) free.step(h);
  const Vec3 seven = free.ahead(h, 7.0 * T), eight = free.ahead(h, 8.0 * T);
  EXPECT_LT((free.ahead(h, 7.25 * T) - (0.75 * seven + 0.25 * eight)).norm(), rounding_m);
}

TEST(Lookahead, IsWhereTheProxyGoes) {
  for (const int order : {1, 2}) {
    for (const char* objects : {nothing, smooth_wall, rough_wall, moving_box}) {
      SCOPED_TRACE(std::string(objects) + " order " + std::to_string(order));
      World world(objects, order);
      expect_future(world, 2000);
    }
  }
}

TEST(Lookahead, IsNeverInAFlatWall) {
  for (const int order : {1, 2}) {
    World world(smooth_wall, order);
    world.world->start(Vec3::Zero());
    for (int k = 0; k < 3000; ++k) {
      const Vec3 h = force(k) + Vec3(10.0, 0.0, 0.0);
      world.step(h);
      for (const double s : {0.5 * T, horizon_s, 20.5 * T}) ASSERT_LE(world.ahead(h, s).x(), 0.1 + rounding_m);
    }
  }
}

TEST(Lookahead, SticksWhereTheProxySticks) {
  World world(rough_wall);
  world.world->start(Vec3::Zero());
  const Vec3 h(20.0, 6.0, 3.0);  // within the cone of 0.5
  Vec3 q = Vec3::Zero();
  for (int k = 0; k < 500; ++k) q = world.step(h);
  EXPECT_EQ(world.ahead(h), q) << "to the bit";
  EXPECT_EQ(world.step(h), q);
}

TEST(Lookahead, LeavesTheProxyAsItIs) {
  for (const char* objects : {smooth_wall, rough_wall, moving_box}) {
    World looks(objects), without(objects, 1, false);
    looks.world->start(Vec3::Zero());
    without.world->start(Vec3::Zero());
    for (int k = 0; k < 2000; ++k) {
      ASSERT_EQ(looks.step(force(k)), without.step(force(k))) << "step " << k;
      looks.ahead(force(k));
    }
  }
}

TEST(Lookahead, AWorldWithoutItStaysAtTheProxy) {
  World without(nothing, 1, false);
  without.world->start(Vec3::Zero());
  Vec3 q = Vec3::Zero();
  for (int k = 0; k < 100; ++k) q = without.step(force(k));
  EXPECT_EQ(without.ahead(force(99)), q);
}

TEST(Lookahead, ADrivenObjectComesAsItWill) {
  World world(
      "objects:\n"
      "  - box: {name: plate, centre_m: [0.06, 0, 0], size_m: [0.1, 0.4, 0.4], motion: {driven: true}}\n");
  world.world->start(Vec3::Zero());
  world.world->set({.parameter = Parameter::position, .object = 0, .position_m = {-0.03, 0.0, 0.0}});
  const Vec3 h(1.0, 0.0, 0.0);
  std::array<Vec3, 8> predicted;
  for (int k = 0; k < 1000; ++k) {
    const Vec3 q = world.step(h);
    Vec3& before = predicted[static_cast<std::size_t>(k % steps)];
    if (k >= steps) {
      ASSERT_LT((q - before).norm(), rounding_m) << "step " << k;
    }
    before = world.ahead(h);
  }
  EXPECT_LT(world.step(h).x(), -0.015) << "it was pushed";
}

// A border slows the proxy down, and so it does what is predicted.
TEST(Lookahead, NeverCrossesABorder) {
  World world(nothing);
  world.world->start(Vec3::Zero());
  const double border_m = 0.05, share = T / (T + 0.05);
  const Vec3 h(40.0, 0.0, 0.0);
  Vec3 q = Vec3::Zero();
  for (int k = 0; k < 3000; ++k) {
    world.limits.hard[0] = {Vec3::Zero(), 0.5 * T, Limit::speed};
    world.limits.hard_count = 1;
    world.limits.planes[0] = {Vec3::UnitX(), share * (border_m - q.x()), ActiveLimits::of(Limit::workspace), share};
    world.limits.plane_count = 1;
    q = world.step(h);
    ASSERT_LE(world.ahead(h).x(), border_m);
    ASSERT_LE((world.ahead(h) - q).norm(), steps * 0.5 * T * (1.0 + 1e-9));
  }
  EXPECT_GT(q.x(), 0.99 * border_m);
}

TEST(Lookahead, TakesNothingFromTheHeap) {
  World world(moving_box);
  world.world->start(Vec3::Zero());
  const std::uint64_t before = tests::allocation_count();
  for (int k = 0; k < 500; ++k) {
    (void)world.world->step(force(k), world.limits);
    (void)world.ahead(force(k));
  }
  EXPECT_EQ(tests::allocation_count(), before);
}

}  // namespace
}  // namespace proxarm::controller
