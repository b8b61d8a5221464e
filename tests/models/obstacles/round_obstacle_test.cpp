// Spheres, capsules and bars, from outside and from inside.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "models/obstacles/round_obstacle.hpp"
#include "tests/models/world/worlds.hpp"

namespace proxarm::tests {
namespace {

using models::Capsule;
using models::LineCore;
using models::Obstacle;
using models::PointCore;
using models::RoundBar;
using models::SegmentCore;
using models::Sphere;
using models::Vec3;

TEST(Contract, RoundBodies) {
  for (const double mu : {0.0, 0.3, 1.0}) {
    expect_contract<3>(world(entry<Sphere>(0, PointCore{Vec3(0.1, 0.2, 0.3)}, 0.3, mu, false)), small_steps({mu}));
    expect_contract<3>(world(entry<Sphere>(0, PointCore{Vec3(0.1, 0.2, 0.3)}, 0.3, mu, true)), small_steps({mu}));
    expect_contract<3>(world(entry<Capsule>(0, SegmentCore({0, 0, 0}, {0.2, 0.1, 0}), 0.2, mu, false)),
                       small_steps({mu}));
    expect_contract<3>(world(entry<Capsule>(0, SegmentCore({0, 0, 0}, {0.2, 0.1, 0}), 0.2, mu, true)),
                       small_steps({mu}));
    expect_contract<3>(world(entry<RoundBar>(0, LineCore{Vec3(0, 0.1, 0), Vec3(1, 2, 2) / 3.0}, 0.2, mu, true)),
                       small_steps({mu}));
  }
}

// On a sphere friction has a closed form: the force makes the angle β = atan μ with the normal, so the line of the
// force passes the centre at R sin β, and the proxy stops where it does. All in the plane of p, q and the centre.
TEST(Sphere, SlidesToTheFrictionCircle) {
  Random random(601);
  for (std::int64_t i = 0; i < scaled(50'000); ++i) {
    const bool inside = random.chance(0.5);
    const double mu = random.uniform(0.0, 1.0), R = random.log_uniform(0.01, 1.0), beta = std::atan(mu);
    const Vec3 centre = random.in_box<3>(0.5);
    const Sphere sphere(PointCore{centre}, R, mu, inside);
    const Vec3 x = random.direction<3>(), y = x.cross(random.direction<3>()).normalized();
    // q at angle 0, p at angle φ and at d from the centre.
    const double phi = random.log_uniform(1e-6, 0.5), depth = random.log_uniform(1e-6, 0.3) * R;
    const double d = inside ? R + depth : R - depth;
    const Vec3 q = centre + R * x, p = centre + d * (std::cos(phi) * x + std::sin(phi) * y);
    const Obstacle::Step s = sphere.step(1.0, p, q);
    ASSERT_TRUE(s.touches);
    const double reach = inside ? beta - std::asin(R / d * std::sin(beta)) : std::asin(R / d * std::sin(beta)) - beta;
    const double theta = R / d * std::sin(beta) >= 1.0 ? 0.0 : std::max(0.0, phi - reach);
    const Vec3 expected = centre + R * (std::cos(theta) * x + std::sin(theta) * y);
    // asin loses half the digits where its argument nears one: not in these states (d ≥ 0.7 R, β ≤ 45°), but its
    // derivative reaches 10.
    ASSERT_LE((s.r - expected).norm(), 1e-14) << "inside " << inside << " μ " << mu << " R " << R << " φ " << phi;
  }
}

// From far beyond a cavity, p and q lie on opposite sides of its middle and the way between them passes that closely:
// there the proxy turns around within a tiny part of the way. Counted from p, or in coordinates of W, that part was
// lost in rounding, and the force left its friction cone altogether.
TEST(RoundBodies, SlideToTheFrictionConeFromFarBeyondACavity) {
  Random random(606);
  const auto slide = [](const auto& core, double R, double mu, const Vec3& p, const Vec3& q) {
    const models::RoundObstacle cavity(core, R, mu, true);
    const Obstacle::Step s = cavity.step(1.0, p, q);
    ASSERT_EQ(s.touches, cavity.distance(p) < 0.0);  // along an endless bar it may be inside
    if (!s.touches) return;
    const Vec3 f = s.r - p, n = s.normal, f_t = f - n * n.dot(f), d = s.r - q, v = d - n * n.dot(d);
    // Rounding of p, and of q beside the slip's length, with the 64 units that all laws are judged by.
    const double small = 64.0 * std::numeric_limits<double>::epsilon();
    const double size = f.norm() + 1.0, uncertain = small / (v.norm() + 1e-300);
    ASSERT_LE(f_t.norm(), mu * n.dot(f) + small * size);
    if (!s.slips) return;
    ASSERT_NEAR(f_t.norm(), mu * n.dot(f), small * size);
    ASSERT_LE((f_t.normalized() + v.normalized()).norm(), uncertain + small * size / f_t.norm());
  };
  for (std::int64_t i = 0; i < scaled(20'000); ++i) {
    const double R = random.uniform(0.3, 1.0), mu = random.uniform(0.05, 1.2);
    const Vec3 a = random.in_box<3>(0.3), b = random.in_box<3>(0.3);
    const Vec3 middle = a + random.uniform(0.0, 1.0) * (b - a);
    const Vec3 q = middle + random.uniform(0.1, 0.3) * random.direction<3>();
    // Past the middle by what is above rounding of a way of some metres, to 0.1 m.
    const Vec3 through = middle + random.log_uniform(1e-14, 0.1) * random.direction<3>();
    const Vec3 p = through + random.log_uniform(3.0, 1e6) * (through - q).normalized();
    const Vec3 axis = (b - a).normalized();
    slide(PointCore{middle}, R, mu, p, q);
    // On a way along the axis, rounding of what is along decides on the side.
    if (axis.cross((p - q).normalized()).norm() < 0.3) continue;
    slide(SegmentCore(a, b), R, mu, p, q);
    slide(models::LineCore{a, axis}, R, mu, p, q);
    if (HasFatalFailure()) FAIL() << "state " << i;
  }
}

TEST(Sphere, LetsTheProxyGoAround) {
  const Sphere sphere(PointCore{Vec3::Zero()}, 0.1, 0.1, false);
  EXPECT_FALSE(sphere.step(1.0, {0.5, 0, 0}, {-0.5, 0.15, 0}).touches) << "slides past";
  EXPECT_TRUE(sphere.step(1.0, {0.5, 0.001, 0}, {-0.5, 0, 0}).touches) << "holds what is pushed straight through";
}

}  // namespace
}  // namespace proxarm::tests
