#include <gtest/gtest.h>

#include "models/base/random.hpp"
#include "models/rigid/rigid_world.hpp"
#include "rigid_judge.hpp"

namespace proxarm::models {
namespace {

Pose random_pose(Random& random, double half) {
  Pose X = Pose::Identity();
  X.linear() = Eigen::AngleAxisd(random.uniform(-3.0, 3.0), random.direction()).toRotationMatrix();
  X.translation() = random.in_box(half);
  return X;
}

Mat6 random_stiffness(Random& random) {
  const double M = random.log_uniform(0.5, 20.0), J = M * random.log_uniform(1e-4, 1e-2);
  Mat6 K = Mat6::Zero();
  K.diagonal() << Vec3::Constant(1e6 * M), Vec3::Constant(1e6 * J);
  return K;
}

// A box among boxes and planes, sent about as a hand would: after each step nothing overlaps, and the law holds.
TEST(RigidWorlds, ABoxAmongBoxesKeepsTheLaw) {
  const int worlds = 40, steps = 200;
  int unresolved = 0, touching = 0, judged = 0;
  LawFigures worst;
  double deepest = 0.0;
  for (int w = 0; w < worlds; ++w) {
    Random random(static_cast<std::uint64_t>(100 + w));
    const Vec3 size(random.uniform(0.01, 0.05), random.uniform(0.01, 0.05), random.uniform(0.01, 0.05));
    std::vector<RigidObject> objects;
    std::vector<Polyhedron> bodies;
    std::vector<double> mu;
    for (int i = 0; i < 6; ++i) {
      const Vec3 other(random.uniform(0.02, 0.1), random.uniform(0.02, 0.1), random.uniform(0.02, 0.1));
      const Pose X = random_pose(random, 0.08);
      RigidObject object;
      object.shape = solid_of(BoxTool{other}, X);
      object.friction = random.chance(0.3) ? 0.0 : random.uniform(0.0, 0.8);
      object.object = i;
      mu.push_back(object.friction);
      bodies.push_back(polyhedron_of_box(other, X));
      objects.push_back(std::move(object));
    }
    RigidWorld g({{{BoxTool{size}, Pose::Identity(), {}}}}, std::move(objects));
    const Mat6 K = random_stiffness(random);
    const auto apart = [&](const ToolPose& pose) {
      double least = 1.0;
      const Polyhedron tool = polyhedron_of_box(size, isometry(pose));
      for (const Polyhedron& body : bodies) least = std::min(least, separation(tool, body));
      return least;
    };
    ToolPose q;
    do {
      q = tool_pose(random_pose(random, 0.15));
    } while (apart(q) < 1e-3);
    Twist way = Twist::Zero();
    for (int k = 0; k < steps; ++k) {
      if (k % 20 == 0) {
        // Towards the middle, by up to 2 mm and 0.02 rad a step.
        way.head<3>() = -q.position.normalized() * random.log_uniform(1e-6, 2e-3) + random.in_box(3e-4);
        way.tail<3>() = random.log_uniform(1e-5, 2e-2) * random.direction();
      }
      const ToolPose p = moved(q, way);
      const ToolPose r = g.step(K, p, q);
      const double gap = apart(r);
      if (g.unresolved()) {
        ++unresolved;
      } else {
        if (!g.contacts().empty()) {
          ++touching;
          const LawFigures law = judge_law(g.contacts(), K, p, q, r, mu);
          worst.imbalance = std::max(worst.imbalance, law.imbalance);
          worst.outside_cone = std::max(worst.outside_cone, law.outside_cone);
          worst.against_slip = std::max(worst.against_slip, law.against_slip);
          worst.pull = std::max(worst.pull, law.pull);
          worst.gap_m = std::max(worst.gap_m, law.gap_m);
        }
        ++judged;
      }
      deepest = std::min(deepest, gap);
      q = r;
    }
  }
  EXPECT_GE(deepest, -1e-12);
  EXPECT_GT(touching, 500) << "or else this looks at nothing";
  EXPECT_LE(unresolved, judged / 1000);
  EXPECT_LE(worst.imbalance, 1e-10);
  EXPECT_LE(worst.outside_cone, 1e-12);
  EXPECT_LE(worst.against_slip, 1e-8) << "slips of a picometre have a direction only to 1e-4 of that";
  EXPECT_EQ(worst.pull, 0.0);
  EXPECT_LE(worst.gap_m, 1e-12);
}

}  // namespace
}  // namespace proxarm::models
