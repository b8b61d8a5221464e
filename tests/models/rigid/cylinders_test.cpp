// The outside of cylinders, as tools and as objects: nothing overlaps, and the law holds.
#include <gtest/gtest.h>

#include <functional>

#include "models/base/random.hpp"
#include "models/rigid/rigid_world.hpp"
#include "tests/models/rigid/cylinder_bodies.hpp"
#include "tests/models/rigid/rigid_meshes.hpp"
#include "tests/models/surfaces/random_states.hpp"

namespace proxarm::models {
namespace {

Mat6 random_stiffness(Random& random) {
  const double M = random.log_uniform(0.5, 20.0), J = M * random.log_uniform(1e-4, 1e-2);
  Mat6 K = Mat6::Zero();
  K.diagonal() << Vec3::Constant(1e6 * M), Vec3::Constant(1e6 * J);
  return K;
}

Can random_can(Random& random, double least, double most) {
  Can can;
  can.length = random.uniform(least, most);
  can.radius = 0.5 * random.uniform(least, most);
  return can;
}

Body random_box(Random& random, double least, double most) {
  Body body;
  body.size = random_size(random, least, most);
  return body;
}

Body random_round(Random& random, double least, double most) {
  Body body;
  do {
    body = random_body(random, least, most);
  } while (!(body.radius > 0.0));
  return body;
}

// A tool among objects, and how far it is from all of them.
struct World {
  Tool tool;
  std::vector<RigidObject> objects;
  std::vector<double> mu;
  std::function<double(const ToolPose&)> apart_m;
  double around_m = 0.15;
  std::shared_ptr<std::vector<Vec3>> claimed = std::make_shared<std::vector<Vec3>>();  // normals of the last contacts

  void add(decltype(RigidObject::shape) shape, Random& random) {
    const auto number = static_cast<std::int32_t>(mu.size());
    mu.push_back(random.chance(0.3) ? 0.0 : random.uniform(0.0, 0.8));
    objects.push_back({std::move(shape), mu.back(), number});
  }
  void give(decltype(ToolPart::shape) shape) { tool = {{{std::move(shape), Pose::Identity(), {}}}}; }
};

Pushed pushed(std::uint64_t seed, const std::function<World(Random&)>& make) {
  Pushed out;
  for (std::uint64_t i = 0; i < static_cast<std::uint64_t>(tests::scaled(40)); ++i) {
    Random random(seed + i);
    World world = make(random);
    RigidWorld g(world.tool, world.objects);
    ToolPose q;
    do {
      q = tool_pose(random_pose(random, world.around_m));
    } while (world.apart_m(q) < 1e-3);
    EXPECT_GT(g.clearance_m(q), 0.0);
    const auto apart_m = [&](const ToolPose& pose) {
      world.claimed->clear();
      for (const PoseContact& contact : g.contacts()) world.claimed->push_back(contact.normal_W);
      return world.apart_m(pose);
    };
    push_about(g, random, q, random_stiffness(random), world.mu, 200, Vec3::Zero(), false, apart_m, out);
    EXPECT_GE(out.deepest, -1e-12) << "seed " << seed + i;
    if (testing::Test::HasFailure()) break;
  }
  std::cout << "  " << out.judged << " steps, " << out.touching << " touching, " << out.unresolved
            << " unresolved; deepest " << out.deepest << " m, imbalance " << out.law.imbalance << ", against slip "
            << out.law.against_slip << "\n";
  return out;
}

template <typename Make>
World can_among(Random& random, Make make) {
  World world;
  const Can tool = random_can(random, 0.01, 0.05);
  world.give(CylinderTool{tool.length, tool.radius});
  std::vector<Rounded> bodies;
  for (int i = 0; i < 6; ++i) {
    Body body = make(random, 0.02, 0.1);
    body.X = random_pose(random, 0.08);
    bodies.push_back(rounded(body));
    world.add(solid_of_body(body), random);
  }
  world.apart_m = [=](const ToolPose& pose) {
    double gap = 1.0;
    for (const Rounded& body : bodies) gap = std::min(gap, apart(at(tool, isometry(pose)), body));
    return gap;
  };
  return world;
}

template <typename Make>
World among_cans(Random& random, Make make) {
  World world;
  const Body tool = make(random, 0.01, 0.05);
  world.give(shape_of(tool));
  std::vector<Can> cans;
  for (int i = 0; i < 6; ++i) {
    Can can = random_can(random, 0.02, 0.1);
    can.X = random_pose(random, 0.08);
    cans.push_back(can);
    world.add(solid_of_can(can), random);
  }
  world.apart_m = [=](const ToolPose& pose) {
    const Rounded body = rounded(at(tool, isometry(pose)));
    double gap = 1.0;
    for (const Can& can : cans) gap = std::min(gap, apart(can, body));
    return gap;
  };
  return world;
}

World can_among_cans(Random& random) {
  World world;
  const Can tool = random_can(random, 0.01, 0.05);
  world.give(CylinderTool{tool.length, tool.radius});
  std::vector<Can> cans;
  for (int i = 0; i < 6; ++i) {
    Can can = random_can(random, 0.02, 0.1);
    can.X = random_pose(random, 0.08);
    cans.push_back(can);
    world.add(solid_of_can(can), random);
  }
  world.apart_m = [=, claimed = world.claimed](const ToolPose& pose) {
    double gap = 1.0;
    for (const Can& can : cans) gap = std::min(gap, apart(can, at(tool, isometry(pose)), *claimed));
    return gap;
  };
  return world;
}

// By planes between it and each triangle, and so that none is inside of it.
double can_from_mesh(const Can& can, const std::vector<std::array<Vec3, 3>>& triangles) {
  double least = 1.0;
  const double reach = std::hypot(can.radius, 0.5 * can.length) + 1e-3;
  for (const auto& triangle : triangles) {
    const double size = std::max((triangle[1] - triangle[0]).norm(), (triangle[2] - triangle[0]).norm());
    if ((triangle[0] - can.X.translation()).norm() > reach + size) continue;
    least = std::min(least, apart(can, rounded(triangle)));
  }
  return least;
}

std::vector<std::array<Vec3, 3>> triangles_of(const TriangleMesh& mesh) {
  std::vector<std::array<Vec3, 3>> out;
  for (std::uint32_t f = 0; f < mesh.size(); ++f)
    out.push_back({mesh.corner(f, 0), mesh.corner(f, 1), mesh.corner(f, 2)});
  return out;
}

TEST(Cylinders, AsAToolAmongBoxesOneKeepsTheLaw) {
  expect_law(pushed(1000, [](Random& random) { return can_among(random, random_box); }));
}
TEST(Cylinders, AsAToolAmongSpheresAndCapsulesOneKeepsTheLaw) {
  expect_law(pushed(20000, [](Random& random) { return can_among(random, random_round); }));
}
TEST(Cylinders, AsObjectsTheyHoldABoxByTheLaw) {
  expect_law(pushed(40000, [](Random& random) { return among_cans(random, random_box); }));
}
TEST(Cylinders, AsObjectsTheyHoldSpheresAndCapsulesByTheLaw) {
  expect_law(pushed(60000, [](Random& random) { return among_cans(random, random_round); }));
}

TEST(Cylinders, AsAToolAmongCylindersOneKeepsTheLaw) { expect_law(pushed(120000, can_among_cans)); }

TEST(Cylinders, AsAToolOnARoughBallOneKeepsTheLaw) {
  expect_law(pushed(80000, [](Random& random) {
    World world;
    const Can tool = random_can(random, 0.01, 0.05);
    world.give(CylinderTool{tool.length, tool.radius});
    const auto ball = rough_ball(random, random.uniform(0.02, 0.08), 2 + random.below(6));
    world.add(std::make_shared<const TriangleFeatures>(ball), random);
    const auto triangles = triangles_of(*ball);
    world.apart_m = [=](const ToolPose& pose) {
      if (ball->encloses(pose.position)) return -1.0;
      return can_from_mesh(at(tool, isometry(pose)), triangles);
    };
    return world;
  }));
}

TEST(Cylinders, AsObjectsTheyHoldARoughBallByTheLaw) {
  expect_law(pushed(100000, [](Random& random) {
    World world;
    const auto ball = rough_ball(random, random.uniform(0.005, 0.03), 2 + random.below(3));
    world.give(tool_of(*ball));
    std::vector<Can> cans;
    for (int i = 0; i < 4; ++i) {
      Can can = random_can(random, 0.02, 0.1);
      can.X = random_pose(random, 0.08);
      cans.push_back(can);
      world.add(solid_of_can(can), random);
    }
    const auto triangles = triangles_of(*ball);
    world.apart_m = [=](const ToolPose& pose) {
      double gap = 1.0;
      for (const Can& can : cans) {
        const Can seen = at(can, isometry(pose).inverse());
        if (ball->encloses(seen.X.translation())) return -1.0;
        gap = std::min(gap, can_from_mesh(seen, triangles));
      }
      return gap;
    };
    return world;
  }));
}

}  // namespace
}  // namespace proxarm::models
