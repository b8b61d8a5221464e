// Tools inside of hollow spheres, capsules, cylinders and boxes at random: after each step nothing sticks out, and the
// law holds. A peg in its hole, whose clearance is a thousandth of its radius, among them.
#include <gtest/gtest.h>

#include <functional>

#include "models/base/random.hpp"
#include "models/rigid/rigid_world.hpp"
#include "tests/models/rigid/rigid_judge.hpp"

namespace proxarm::models {
namespace {

// -- the judge: all points within a radius of some points, and circles ------------------------------------------------

struct Circle {
  Vec3 centre = Vec3::Zero(), u = Vec3::UnitX(), v = Vec3::UnitY();
  double radius = 0.0;
};
struct Inside {
  std::vector<Vec3> points;
  double radius = 0.0;
  std::vector<Circle> circles;
};
using Real = long double;
using Depth = std::function<Real(const Eigen::Matrix<Real, 3, 1>&)>;  // of a point below a hollow's surface

// The least of a function on a circle, by places and thirds.
Real least_on(const Circle& circle, const ToolPose& pose, const Depth& depth) {
  constexpr int places = 48;
  constexpr Real step = 2.0L * 3.14159265358979323846264L / places;
  const Mat3 R = pose.orientation.toRotationMatrix();
  const Eigen::Matrix<Real, 3, 1> c = (pose.position + R * circle.centre).cast<Real>();
  const Eigen::Matrix<Real, 3, 1> u = circle.radius * (R * circle.u).cast<Real>();
  const Eigen::Matrix<Real, 3, 1> v = circle.radius * (R * circle.v).cast<Real>();
  const auto at = [&](Real angle) { return depth(c + std::cos(angle) * u + std::sin(angle) * v); };
  std::array<Real, places> value;
  for (int k = 0; k < places; ++k) value[static_cast<std::size_t>(k)] = at(step * static_cast<Real>(k));
  Real least = value[0];
  for (int k = 0; k < places; ++k) {
    const Real here = value[static_cast<std::size_t>(k)];
    if (here > value[static_cast<std::size_t>((k + 1) % places)]) continue;
    if (here > value[static_cast<std::size_t>((k + places - 1) % places)]) continue;
    Real low = step * static_cast<Real>(k - 1), high = step * static_cast<Real>(k + 1);
    for (int i = 0; i < 60; ++i) {
      const Real x = low + (high - low) / 3.0L, y = high - (high - low) / 3.0L;
      (at(x) > at(y) ? low : high) = at(x) > at(y) ? x : y;
    }
    least = std::min(least, at(0.5L * (low + high)));
  }
  return least;
}

double least_depth(const Inside& tool, const ToolPose& pose, const Depth& depth) {
  Real least = 1.0L;
  for (const Vec3& p : tool.points) {
    least = std::min(least, depth((pose * p).cast<Real>()) - static_cast<Real>(tool.radius));
  }
  for (const Circle& circle : tool.circles) least = std::min(least, least_on(circle, pose, depth));
  return static_cast<double>(least);
}

Depth in_segment(const Vec3& from, const Vec3& to, double radius) {
  return [=](const Eigen::Matrix<Real, 3, 1>& p) {
    const Eigen::Matrix<Real, 3, 1> a = from.cast<Real>(), d = (to - from).cast<Real>();
    const Real s = d.isZero(0.0L) ? 0.0L : std::clamp<Real>(d.dot(p - a) / d.squaredNorm(), 0.0L, 1.0L);
    return static_cast<Real>(radius) - (p - a - s * d).norm();
  };
}

Depth in_box(const Vec3& size) {
  return [=](const Eigen::Matrix<Real, 3, 1>& p) { return (0.5L * size.cast<Real>() - p.cwiseAbs()).minCoeff(); };
}

// Along z, about the origin.
Depth in_cylinder(double length, double radius) {
  return [=](const Eigen::Matrix<Real, 3, 1>& p) {
    return std::min(0.5L * static_cast<Real>(length) - std::abs(p.z()),
                    static_cast<Real>(radius) - std::hypot(p.x(), p.y()));
  };
}

// -- hollows and tools ------------------------------------------------------------------------------------------------

struct Hollow {
  std::vector<decltype(RigidObject::shape)> shapes;
  Depth depth;
};

Hollow hollow_sphere(double radius) {
  return {{HollowSphere{Vec3::Zero(), radius}}, in_segment(Vec3::Zero(), Vec3::Zero(), radius)};
}
Hollow hollow_capsule(double length, double radius) {
  const Vec3 half(0.0, 0.0, 0.5 * length);
  return {{HollowTube{-half, half, radius, false}}, in_segment(-half, half, radius)};
}
Hollow hollow_cylinder(double length, double radius) {
  const Vec3 half(0.0, 0.0, 0.5 * length);
  return {
      {HollowTube{-half, half, radius, true}, FlatSide{Vec3::UnitZ(), -half.z()}, FlatSide{-Vec3::UnitZ(), -half.z()}},
      in_cylinder(length, radius)};
}
Hollow hollow_box(const Vec3& size) {
  Hollow out{{}, in_box(size)};
  for (int k = 0; k < 3; ++k) {
    for (const double sign : {-1.0, 1.0}) out.shapes.emplace_back(FlatSide{sign * Vec3::Unit(k), -0.5 * size[k]});
  }
  return out;
}

struct Shaped {
  Tool tool;
  Inside inside;
};

Shaped cylinder_tool(double length, double radius) {
  Shaped out{{{{CylinderTool{length, radius}, Pose::Identity(), {}}}}, {}};
  for (const double z : {-0.5 * length, 0.5 * length}) {
    out.inside.circles.push_back({{0.0, 0.0, z}, Vec3::UnitX(), Vec3::UnitY(), radius});
  }
  return out;
}

Shaped random_tool(Random& random, int kind) {
  const double length = random.uniform(0.01, 0.03), radius = random.uniform(0.003, 0.01);
  if (kind == 0) return {{{{SphereTool{radius}, Pose::Identity(), {}}}}, {{Vec3::Zero()}, radius, {}}};
  if (kind == 1) {
    const Vec3 half(0.0, 0.0, 0.5 * length);
    return {{{{CapsuleTool{length, radius}, Pose::Identity(), {}}}}, {{-half, half}, radius, {}}};
  }
  if (kind == 2) {
    const Vec3 size(length, radius, 2.0 * radius);
    return {{{{BoxTool{size}, Pose::Identity(), {}}}}, {polyhedron_of_box(size, Pose::Identity()).corners, 0.0, {}}};
  }
  return cylinder_tool(length, radius);
}

// Of the wrench, over the largest force: in a wedge the forces hold each other and are far larger than their sum.
double imbalance(std::span<const PoseContact> contacts, const Mat6& K, const ToolPose& p_hat, const ToolPose& q) {
  Twist off = -(K * difference(q, p_hat));
  double size = off.norm();
  for (const PoseContact& contact : contacts) {
    off.head<3>() += contact.force_W;
    off.tail<3>() += (contact.point_W - q.position).cross(contact.force_W);
    size = std::max(size, contact.force_W.norm());
  }
  return off.norm() / size;
}

// In all directions, by up to 2 mm and 0.02 rad a step, or as a hand moves a peg: 0.3 mm and 0.01 rad.
Pushed inside_of(const Hollow& hollow, const Shaped& tool, std::uint64_t seed, int steps, double mu,
                 const Vec2& most = {2e-3, 2e-2}) {
  Pushed out;
  Random random(seed);
  std::vector<RigidObject> objects;
  for (const auto& shape : hollow.shapes) {
    RigidObject object;
    object.shape = shape;
    object.friction = mu;
    objects.push_back(std::move(object));
  }
  RigidWorld g(tool.tool, std::move(objects));
  Mat6 K = Mat6::Zero();
  K.diagonal() << Vec3::Constant(4e6), Vec3::Constant(5e4);
  const auto apart = [&](const ToolPose& pose) { return least_depth(tool.inside, pose, hollow.depth); };
  ToolPose q;
  EXPECT_GT(apart(q), 0.0);
  EXPECT_NEAR(g.clearance_m(q), apart(q), 1e-15);
  Twist way = Twist::Zero();
  for (int k = 0; k < steps; ++k) {
    if (k % 25 == 0) way << random.log_arrow(1e-7, most[0]), random.log_arrow(1e-6, most[1]);
    const ToolPose p = moved(q, way), r = g.step(K, p, q);
    out.take(g, apart(r), [&] {
      LawFigures law = judge_law(g.contacts(), K, p, q, r, {mu});
      law.imbalance = imbalance(g.contacts(), K, p, r);
      return law;
    });
    q = r;
  }
  return out;
}

void take(Pushed& all, const Pushed& one) {
  all.judged += one.judged;
  all.touching += one.touching;
  all.unresolved += one.unresolved;
  all.deepest = std::min(all.deepest, one.deepest);
  all.law.take(one.law);
}

// What is unresolved are wedges: two contacts that hold each other by friction, while the tool turns about the line
// between them.
void expect_law_inside(const Pushed& out) {
  EXPECT_GE(out.deepest, -1e-12);
  EXPECT_GT(out.touching, 300) << "or else this looks at nothing";
  EXPECT_LE(out.unresolved, out.judged / 100);
  EXPECT_LE(out.law.imbalance, 1e-9) << "where contacts hold each other, a local problem is solved to 1e-10 of a step";
  EXPECT_LE(out.law.outside_cone, 1e-12);
  EXPECT_LE(out.law.against_slip, 1e-4) << "of a slip of a picometre, by places of 1e-16 m";
  EXPECT_EQ(out.law.pull, 0.0);
  EXPECT_LE(out.law.gap_m, 1e-10) << "of a contact that presses with 1e-9 of the largest force";
}

class HollowWorlds : public ::testing::TestWithParam<int> {};

TEST_P(HollowWorlds, KeepTheLaw) {
  const std::array<Hollow, 4> hollows = {hollow_sphere(0.04), hollow_capsule(0.05, 0.03), hollow_cylinder(0.07, 0.03),
                                         hollow_box({0.05, 0.06, 0.07})};
  for (std::size_t i = 0; i < hollows.size(); ++i) {
    if (GetParam() == 3 && i == 1) continue;  // refused by compile_rigid()
    SCOPED_TRACE(i);
    Pushed all;
    for (std::uint64_t world = 0; world < 10; ++world) {
      Random random(900 + world);
      take(all, inside_of(hollows[i], random_tool(random, GetParam()), 700 + world, 300, 0.3));
    }
    expect_law_inside(all);
  }
}

INSTANTIATE_TEST_SUITE_P(Tools, HollowWorlds, ::testing::Range(0, 4));

TEST(HollowWorlds, APegOfFifteenMicrometresKeepsTheLaw) {
  for (const double length : {0.01, 0.03}) {
    SCOPED_TRACE(length);
    const Pushed all =
        inside_of(hollow_cylinder(0.2, 0.01), cylinder_tool(length, 0.01 - 15e-6), 31, 4000, 0.15, {3e-4, 1e-2});
    expect_law_inside(all);
  }
}

}  // namespace
}  // namespace proxarm::models
