// Tools among solids at random: after each step nothing overlaps, and the law holds.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "models/base/random.hpp"
#include "models/rigid/rigid_world.hpp"
#include "tests/models/rigid_judges/rigid_bodies.hpp"

namespace proxarm::models {
namespace {

// Tools as `make` draws them, among six solids.
template <typename Make>
Pushed among_solids(std::uint64_t seed, Make make) {
  Pushed out;
  for (std::uint64_t world = 0; world < 40; ++world) {
    Random random(seed + world);
    const std::vector<Body> parts = make(random);
    Tool tool;
    for (const Body& part : parts) tool.parts.push_back({shape_of(part), part.X, {}});
    std::vector<RigidObject> objects;
    std::vector<Body> bodies;
    std::vector<double> mu;
    for (int i = 0; i < 6; ++i) {
      Body body = random_body(random, 0.02, 0.1);
      body.X = random_pose(random, 0.08);
      mu.push_back(random.chance(0.3) ? 0.0 : random.uniform(0.0, 0.8));
      bodies.push_back(body);
      objects.push_back(object_of(body, mu.back(), i));
    }
    RigidWorld g(tool, std::move(objects));
    const auto least = [&](const ToolPose& pose) {
      double gap = 1.0;
      for (const Body& part : parts) {
        for (const Body& body : bodies) gap = std::min(gap, apart(at(part, isometry(pose)), body));
      }
      return gap;
    };
    ToolPose q;
    do {
      q = tool_pose(random_pose(random, 0.15));
    } while (least(q) < 1e-3);
    push_about(g, random, q, random_stiffness(random), mu, 200, Vec3::Zero(), false, least, out);
  }
  return out;
}

TEST(RigidWorlds, ABoxKeepsTheLaw) {
  expect_law(among_solids(100, [](Random& random) {
    return std::vector<Body>{{Pose::Identity(), random_size(random, 0.01, 0.05), 0.0}};
  }));
}

TEST(RigidWorlds, SpheresAndCapsulesKeepTheLaw) {
  expect_law(among_solids(200, [](Random& random) {
    const double length = random.chance(0.5) ? random.uniform(0.01, 0.05) : 0.0;
    return std::vector<Body>{{Pose::Identity(), {0.0, 0.0, length}, random.uniform(0.003, 0.02)}};
  }));
}

TEST(RigidWorlds, ACompoundKeepsTheLaw) {
  expect_law(among_solids(300, [](Random& random) {
    std::vector<Body> parts = {random_body(random, 0.01, 0.03), random_body(random, 0.01, 0.03)};
    for (Body& part : parts) part.X = random_pose(random, 0.02);
    return parts;
  }));
}

// The hull of points as `make` draws them, among five boxes.
template <typename Make>
Pushed hull_among_boxes(std::uint64_t seed, Make make) {
  Pushed out;
  for (std::uint64_t world = 0; world < 40; ++world) {
    Random random(seed + world);
    const ConvexTool hull{make(random)};
    const Polyhedron body = polyhedron_of_hull(hull.points_m);
    std::vector<RigidObject> objects;
    std::vector<Polyhedron> others;
    for (int i = 0; i < 5; ++i) {
      const Vec3 size = random_size(random, 0.02, 0.1);
      const Pose X = random_pose(random, 0.08);
      RigidObject object;
      object.shape = solid_of(BoxTool{size}, X);
      object.friction = 0.3;
      objects.push_back(std::move(object));
      others.push_back(polyhedron_of_box(size, X));
    }
    RigidWorld g({{{hull, Pose::Identity(), {}}}}, std::move(objects));
    const auto least = [&](const ToolPose& pose) {
      const Polyhedron moved_body = at(body, pose);
      double gap = 1.0;
      for (const Polyhedron& other : others) gap = std::min(gap, separation(moved_body, other));
      return gap;
    };
    ToolPose q;
    do {
      q = tool_pose(random_pose(random, 0.15));
    } while (least(q) < 1e-3);
    push_about(g, random, q, random_stiffness(random), {0.3}, 200, Vec3::Zero(), false, least, out);
  }
  return out;
}

TEST(RigidWorlds, AHullAmongBoxesKeepsTheLaw) {
  expect_law(hull_among_boxes(400, [](Random& random) {
    std::vector<Vec3> points;
    const int count = 4 + random.below(5);
    for (int i = 0; i < count; ++i) points.push_back(random.uniform(0.01, 0.03) * random.direction());
    return points;
  }));
}

// Boxes and prisms whose sides are flat but for noise of 10 pm to 10 nm, or for single precision: each side is several.
TEST(RigidWorlds, AHullWhoseSidesAreNearlyFlatKeepsTheLaw) {
  expect_law(hull_among_boxes(500, [](Random& random) {
    const Mat3 R = random_pose(random, 0.0).linear();
    const double noise = random.log_uniform(1e-11, 1e-8), half = random.uniform(0.005, 0.03);
    const bool single = random.chance(0.5);
    const int sides = 3 + random.below(4);
    std::vector<Vec3> points;
    for (int k = 0; k < 2 * sides; ++k) {
      const int corner = k / 2;
      const double a = 2.0 * std::numbers::pi * corner / sides;
      const Vec3 p = R * Vec3(0.02 * std::cos(a), 0.02 * std::sin(a), k % 2 == 0 ? half : -half);
      points.push_back(single ? Vec3(p.cast<float>().cast<double>()) : Vec3(p + random.in_box(noise)));
    }
    return points;
  }));
}

}  // namespace
}  // namespace proxarm::models
