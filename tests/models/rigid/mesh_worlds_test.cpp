#include <gtest/gtest.h>

#include <functional>

#include "models/base/random.hpp"
#include "models/rigid/rigid_world.hpp"
#include "rigid_judge.hpp"

namespace proxarm::models {
namespace {

const Vec3 block_size(0.1, 0.08, 0.06);

std::shared_ptr<const TriangleMesh> block() {
  TriangleSoup soup;
  soup.vertices = polyhedron_of_box(block_size, Pose::Identity()).corners;
  const auto quad = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
    soup.triangles.push_back({a, b, c});
    soup.triangles.push_back({a, c, d});
  };
  quad(0, 2, 3, 1);
  quad(4, 5, 7, 6);
  quad(0, 1, 5, 4);
  quad(2, 6, 7, 3);
  quad(0, 4, 6, 2);
  quad(1, 3, 7, 5);
  return std::make_shared<const TriangleMesh>(std::move(soup));
}

double to_block(const Vec3& x) {
  const Vec3 d = x.cwiseAbs() - 0.5 * block_size;
  return d.cwiseMax(0.0).norm() + std::min(0.0, d.maxCoeff());
}

// The distance of a convex function's least value along a segment, by thirds.
double to_block(const Vec3& a, const Vec3& b) {
  double low = 0.0, high = 1.0;
  for (int k = 0; k < 150; ++k) {
    const double x = low + (high - low) / 3.0, y = high - (high - low) / 3.0;
    if (to_block(a + x * (b - a)) < to_block(a + y * (b - a))) {
      high = y;
    } else {
      low = x;
    }
  }
  return std::min({to_block(a + low * (b - a)), to_block(a), to_block(b)});
}

struct Figures {
  int judged = 0, touching = 0, unresolved = 0;
  double deepest = 0.0;
  LawFigures law;
};

// Tools around a block that is a mesh, sent against it by up to a millimetre and a hundredth of a radian a step;
// `apart` is their distance, of which the step knows nothing.
Figures push_about(const Tool& tool, const std::function<double(const ToolPose&)>& apart) {
  Figures out;
  for (std::uint64_t world = 0; world < 15; ++world) {
    Random random(500 + world);
    RigidObject object;
    object.shape = std::make_shared<const TriangleFeatures>(block());
    object.friction = 0.4;
    std::vector<RigidObject> objects;
    objects.push_back(std::move(object));
    RigidWorld g(tool, std::move(objects));
    Mat6 K = Mat6::Zero();
    K.diagonal() << Vec3::Constant(4e6), Vec3::Constant(4e3);
    ToolPose q;
    q.position = 0.12 * random.direction();
    q.orientation = rotation_by(random.arrow(0.0, 3.0));
    if (apart(q) < 1e-3) continue;
    Twist way = Twist::Zero();
    for (int k = 0; k < 500; ++k) {
      if (k % 20 == 0) {
        way.head<3>() = -q.position.normalized() * random.log_uniform(1e-6, 1e-3) + random.in_box(3e-4);
        way.tail<3>() = random.log_uniform(1e-5, 2e-2) * random.direction();
      }
      const ToolPose p = moved(q, way);
      const ToolPose r = g.step(K, p, q);
      out.deepest = std::min(out.deepest, apart(r));
      ++out.judged;
      if (g.unresolved()) {
        ++out.unresolved;
      } else if (!g.contacts().empty()) {
        ++out.touching;
        const LawFigures law = judge_law(g.contacts(), K, p, q, r, {0.4});
        out.law.imbalance = std::max(out.law.imbalance, law.imbalance);
        out.law.outside_cone = std::max(out.law.outside_cone, law.outside_cone);
        out.law.against_slip = std::max(out.law.against_slip, law.against_slip);
      }
      q = r;
    }
  }
  return out;
}

void expect_law(const Figures& figures) {
  EXPECT_GE(figures.deepest, -1e-12);
  EXPECT_GT(figures.touching, 300);
  EXPECT_LE(figures.unresolved, figures.judged / 1000);
  EXPECT_LE(figures.law.imbalance, 1e-10);
  EXPECT_LE(figures.law.outside_cone, 1e-12);
  EXPECT_LE(figures.law.against_slip, 1e-8);
}

TEST(RigidWorldsOfMeshes, ACapsuleKeepsTheLaw) {
  expect_law(push_about({{{CapsuleTool{0.03, 0.004}, Pose::Identity(), {}}}}, [](const ToolPose& q) {
    return to_block(q * Vec3(0.0, 0.0, -0.015), q * Vec3(0.0, 0.0, 0.015)) - 0.004;
  }));
}

TEST(RigidWorldsOfMeshes, ASphereKeepsTheLaw) {
  expect_law(push_about({{{SphereTool{0.01}, Pose::Identity(), {}}}},
                        [](const ToolPose& q) { return to_block(q.position) - 0.01; }));
}

}  // namespace
}  // namespace proxarm::models
