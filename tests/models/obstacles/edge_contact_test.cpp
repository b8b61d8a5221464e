// What an edge or a corner holds by friction, against (17) itself.
#include "models/obstacles/edge_contact.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "models/obstacles/box_obstacle.hpp"
#include "models/obstacles/cylinder_obstacle.hpp"
#include "tests/models/surfaces/random_states.hpp"
#include "tests/models/world/worlds.hpp"

namespace proxarm::tests {
namespace {

using models::EdgeContact;
using models::Vec3;

// (17) for one contact, written out: the part of f across n is μ times the part along it, against the slip; or less
// where it sticks. The error, relative to f.
double error_of_17(const Vec3& n, bool slips, double mu, const Vec3& r, const Vec3& p, const Vec3& q) {
  const Vec3 f = (r - p) / (r - p).norm(), d = r - q;
  const Vec3 across = f - n * n.dot(f), slip = d - n * n.dot(d);
  if (!slips) return std::max(slip.norm() / d.norm(), across.norm() - mu * n.dot(f));
  return (across + mu * n.dot(f) * slip.normalized()).norm();
}

TEST(EdgeContact, KeepsCoulombsLawAtAnEdge) {
  Random random(1125);
  const models::Layer rigid;
  const Vec3 x = Vec3::UnitX(), z = Vec3::UnitZ();
  std::int64_t slipped = 0, stuck = 0;
  for (std::int64_t i = 0; i < scaled(200'000); ++i) {
    // p inside of the solid x < 0, z < 0; q beside the edge.
    const Vec3 p(-random.log_uniform(1e-6, 0.1), random.uniform(-0.1, 0.1), -random.log_uniform(1e-6, 0.1));
    const Vec3 q(random.log_uniform(1e-6, 0.1), random.uniform(-0.1, 0.1), random.log_uniform(1e-6, 0.1));
    const double mu = random.log_uniform(0.1, 10.0);
    const models::StepOnPlanes step{mu, 1.0, rigid, p, q};
    const auto on_x = step.on(models::FlatSurface<3>(Vec3::Zero(), x));
    const auto on_z = step.on(models::FlatSurface<3>(Vec3::Zero(), z));
    if (!(on_x.r.z() > 0.0 && on_z.r.x() > 0.0)) continue;  // a face holds it
    const EdgeContact held = models::hold_at_edge(Vec3::Zero(), z, x, step);
    ASSERT_LE(std::hypot(held.r.x(), held.r.z()), 1e-16) << i;
    ASSERT_GE(std::min(held.normal.x(), held.normal.z()), 0.0) << i;
    // θ is known to a few units in the last place; the slip's direction to the rounding of r over the slip.
    const Vec3 d = held.r - q;
    const double slip = (d - held.normal * held.normal.dot(d)).norm();
    ASSERT_LE(error_of_17(held.normal, held.slips, mu, held.r, p, q),
              1e-13 + 1e-16 / (held.r - p).norm() + (held.slips ? 1e-14 / slip : 1e-16 / d.norm()))
        << i;
    (held.slips ? slipped : stuck) += 1;
  }
  EXPECT_GT(slipped, scaled(200));
  EXPECT_GT(stuck, scaled(200));
}

TEST(EdgeContact, KeepsCoulombsLawAtACorner) {
  Random random(1126);
  for (std::int64_t i = 0; i < scaled(20'000); ++i) {
    const Vec3 r = random.in_box<3>(1.0), p = r - random.log_uniform(1e-6, 0.1) * random.direction<3>();
    const Vec3 q = r + random.log_uniform(1e-6, 0.1) * random.direction<3>();
    if (!((r - p).dot(q - r) > 0.0)) continue;  // it comes from where the force points
    const double mu = random.log_uniform(0.01, 10.0);
    const EdgeContact held = models::hold_at_corner(r, mu, p, q);
    EXPECT_EQ(held.r, r);
    ASSERT_LE(std::abs(held.normal.norm() - 1.0), 1e-15);
    // d and f are known to the rounding of coordinates of a metre over their lengths.
    const double rounding = 4e-16 * (1.0 / (r - p).norm() + 1.0 / (r - q).norm());
    ASSERT_LE(error_of_17(held.normal, held.slips, mu, r, p, q), 1e-14 + 10.0 * (1.0 + mu) * rounding) << i;
  }
}

// `proxarm check` found it on a small box: friction took the proxy along a face that it had come to from the side, to
// the face's edge, where it was said to stick though it had slid there.
TEST(EdgeContact, HoldsAProxyThatComesFromBesideTheEdgeOfABox) {
  models::Pose X = models::Pose::Identity();
  X.translation() = Vec3(0.65, 0, 0.42);
  X.linear() = (Eigen::AngleAxisd(0.4, Vec3::UnitZ()) * Eigen::AngleAxisd(0.2, Vec3::UnitY()) *
                Eigen::AngleAxisd(0.3, Vec3::UnitX()))
                   .toRotationMatrix();
  auto g = single(std::make_unique<models::BoxObstacle>(X, Vec3(0.03, 0.03, 0.04), 0.9));
  const double K = 1865.3849127710439;
  const Vec3 p(0.6633559575299387, 0.015846171804914041, 0.43823576383734414);
  const Vec3 q(0.66503235787868586, 0.014018135183759552, 0.43970588315792608);
  const Vec3 r = (*g)(K, p, q);
  ASSERT_EQ(g->contacts().size(), 1u);
  EXPECT_TRUE(obeys_17<3>(g->contacts(), small_steps({0.9}), K, p, q, r));
  EXPECT_LE(std::abs(g->distance(r)), 1e-15);
}

TEST(EdgeContact, HoldsAProxyThatComesFromBesideTheRimOfACylinder) {
  Random random(1127);
  std::int64_t at_rim = 0;
  for (std::int64_t i = 0; i < scaled(100'000); ++i) {
    const double mu = random.uniform(0.3, 2.0), R = random.log_uniform(0.01, 0.3);
    auto g = single(std::make_unique<models::CylinderObstacle>(Vec3(0, 0, -0.2), Vec3::Zero(), R, mu));
    const double beside = random.log_uniform(1e-6, 2e-3), angle = random.uniform(0.0, 6.28);
    const Vec3 out(std::cos(angle), std::sin(angle), 0), along(-std::sin(angle), std::cos(angle), 0);
    const Vec3 q = (R + beside) * out + beside * random.uniform(0.1, 2.0) * Vec3::UnitZ();
    const Vec3 p =
        q - 3.0 * beside * (out + random.uniform(0.1, 1.5) * Vec3::UnitZ() + random.uniform(-1.0, 1.0) * along);
    const Vec3 r = (*g)(1.0, p, q);
    ASSERT_LE(std::abs(g->distance(r)), g->contacts().empty() ? 1.0 : 1e-14) << i;
    if (g->contacts().empty() || std::abs(r.z()) > 1e-15 || std::abs(r.head<2>().norm() - R) > 1e-15) continue;
    ++at_rim;
    ASSERT_TRUE(obeys_17<3>(g->contacts(), small_steps({mu}), 1.0, p, q, r))
        << i << ": " << state_text<3>(1.0, p, q, r);
  }
  EXPECT_GT(at_rim, scaled(1000));
}

}  // namespace
}  // namespace proxarm::tests
