// The integrators in the worlds of models/: what a hand would feel there, whatever the world is made of.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <vector>

#include "controller/proxies/admittance_proxy.hpp"
#include "models/mesh/mesh_surface.hpp"
#include "models/surfaces/coulomb_field.hpp"
#include "models/surfaces/free_space.hpp"
#include "models/surfaces/friction_plane.hpp"
#include "models/surfaces/plane.hpp"
#include "models/surfaces/plane_composition.hpp"
#include "tests/models/mesh/mesh_shapes.hpp"
#include "tests/models/surfaces/random_states.hpp"

namespace proxarm::controller {
namespace {

using models::Vec3;
using tests::Random;
using tests::scaled;

Vec3 random_vector(Random& random, double size) {
  return {random.uniform(-size, size), random.uniform(-size, size), random.uniform(-size, size)};
}

// A box from inside, 20 mm wide, each side with its own friction: edges and corners are met all the time.
std::vector<models::Face> box(double mu) {
  std::vector<models::Face> faces;
  for (int axis = 0; axis < 3; ++axis) {
    for (const double side : {-1.0, 1.0}) {
      faces.push_back({models::FlatSurface<3>(0.01 * side * Vec3::Unit(axis), -side * Vec3::Unit(axis)), mu});
    }
  }
  return faces;
}

double outside(const Vec3& q) { return q.cwiseAbs().maxCoeff() - 0.01; }

// From (26) times ∇q: ½M‖v‖² grows by no more than the hand's work h·∇q, step by step, since f·∇q ≤ 0 in every world at
// rest that is convex from inside: walls push only where q(k) touches them, and friction is against the motion.
TEST(RenderedModels, TakeNoMoreEnergyThanTheHandGives) {
  Random random(101);
  for (std::int64_t run = 0; run < scaled(200); ++run) {
    models::PlaneComposition walls(box(run % 3 == 0 ? 0.0 : random.uniform(0.05, 0.8)));
    const double M = random.log_uniform(0.2, 20), T = random.log_uniform(2e-4, 4e-3);
    AdmittanceProxy<3> proxy({.mass_kg = M, .period_s = T}, walls);
    Vec3 q1 = random_vector(random, 0.009), v1 = random_vector(random, 0.5);
    ASSERT_TRUE(proxy.start({.q = q1, .v = v1, .a = Vec3::Zero()}));
    Vec3 h = Vec3::Zero();
    for (int k = 0; k < 300; ++k) {
      if (k % 20 == 0) h = random_vector(random, 15.0);
      ASSERT_EQ(proxy.step(h), ProxyFault::none);
      const Vec3 q = proxy.q(), v = (q - q1) / T;
      // Rounding: an ulp of 0.01 m in q is 1.7e-18/T in v.
      const double rounding = 1e-15 + M * (v.norm() + v1.norm()) * 1e-17 / T;
      ASSERT_LE(0.5 * M * (v.squaredNorm() - v1.squaredNorm()), h.dot(q - q1) + rounding)
          << "run " << run << " k " << k;
      ASSERT_LE(outside(q), 1e-17);
      q1 = q;
      v1 = v;
    }
  }
}

// Order 2 through edges and corners: never outside, and without a force never faster than at the start.
TEST(RenderedModels, StayInsideAndLoseSpeedAtOrderTwo) {
  Random random(102);
  for (std::int64_t run = 0; run < scaled(200); ++run) {
    models::PlaneComposition walls(box(run % 3 == 0 ? 0.0 : random.uniform(0.05, 0.8)));
    const double T = random.log_uniform(2e-4, 4e-3);
    AdmittanceProxy<3> proxy({.mass_kg = random.log_uniform(0.2, 20), .period_s = T, .order = 2}, walls);
    const Vec3 v0 = random_vector(random, 0.5);
    ASSERT_TRUE(proxy.start({.q = random_vector(random, 0.005), .v = v0, .a = Vec3::Zero()}));
    const bool pushed = run % 2 == 0;
    Vec3 h = Vec3::Zero(), q1 = proxy.q();
    if (outside(q1) > 0.0) continue;  // started a period earlier, it was still outside
    for (int k = 0; k < 300; ++k) {
      if (pushed && k % 20 == 0) h = random_vector(random, 15.0);
      ASSERT_EQ(proxy.step(h), ProxyFault::none);
      ASSERT_LE(outside(proxy.q()), 1e-17) << "run " << run << " k " << k;
      if (!pushed) {
        ASSERT_LE((proxy.q() - q1).norm() / T, v0.norm() * (1 + 1e-9)) << "run " << run << " k " << k;
      }
      q1 = proxy.q();
    }
  }
}

// Pushed into a corner of the box, the proxy rests there and the walls answer with the push, whatever it is made of.
TEST(RenderedModels, RestInACornerAndAnswerThePush) {
  for (const int order : {1, 2}) {
    for (const double mu : {0.0, 0.3}) {
      models::PlaneComposition walls(box(mu));
      AdmittanceProxy<3> proxy({.mass_kg = 2.0, .order = order}, walls);
      const Vec3 h(4.0, -7.0, 5.0);
      for (int k = 0; k < 400; ++k) ASSERT_EQ(proxy.step(h), ProxyFault::none);
      EXPECT_LT((proxy.q() - Vec3(0.01, -0.01, 0.01)).norm(), 1e-17);
      EXPECT_LT((proxy.f() + h).norm(), 1e-11);  // κ·ulp: 2e6 N/m · 1.7e-18 m
    }
  }
}

// A frictional slide along the wall: constant deceleration μ h_n/M under a constant push, to a stop, at both orders.
TEST(RenderedModels, SlideOnAFrictionPlaneAsCoulombSays) {
  for (const int order : {1, 2}) {
    models::FrictionPlane<3> wall(Vec3(0.9, 0.1, 0.6), Vec3(-1.0, 0.0, 0.0), 0.3);
    AdmittanceProxy<3> proxy({.mass_kg = 4.0, .order = order}, wall);
    const double v0 = 0.2, a = 0.3 * 10.0 / 4.0;
    const Vec3 q0(0.9, 0.1, 0.6), along(0.0, 0.6, 0.8);
    ASSERT_TRUE(proxy.start({.q = q0, .v = v0 * along, .a = -a * along, .time_s = 0.0, .contact_established = true}));
    const double stop = v0 / a;
    for (int k = 0; k < 400; ++k) {
      ASSERT_EQ(proxy.step(Vec3(10.0, 0.0, 0.0)), ProxyFault::none);
      const double t = std::min(proxy.time_s(), stop);
      // Rounding of 0.9 m adds up over k² / 2 steps; the stop lies within a step.
      ASSERT_LT((proxy.q() - q0 - (v0 * t - 0.5 * a * t * t) * along).norm(), 1e-10 + (k > 260 ? a * 1e-6 : 0.0));
      ASSERT_NEAR(-proxy.f().x(), 10.0, 1e-8);
      if (t < stop - 0.002) {
        ASSERT_NEAR(proxy.f().dot(along), -3.0, 1e-8);
      }
    }
    // At rest: bit for bit, and without any of the tangential force that nobody exerts.
    const Vec3 rest = proxy.q();
    for (int k = 0; k < 100; ++k) ASSERT_EQ(proxy.step(Vec3(10.0, 0.0, 0.0)), ProxyFault::none);
    EXPECT_EQ(proxy.q(), rest);
    EXPECT_LT(std::abs(proxy.f().dot(along)), 1e-8);
  }
}

// Order 2 takes as many first-order steps as there are events, and no more: a field of friction that reports no
// contacts is noticed, too.
TEST(RenderedModels, FallBackToFirstOrderOnlyAtEvents) {
  models::CoulombField<3> field(2.0);
  AdmittanceProxy<3> proxy({.mass_kg = 4.0, .order = 2}, field);
  for (int k = 0; k < 300; ++k) ASSERT_EQ(proxy.step(Vec3(1.0, 0.0, 0.0)), ProxyFault::none);  // sticks
  EXPECT_EQ(proxy.q(), Vec3::Zero());
  const auto sticking = proxy.first_order_steps();
  EXPECT_LE(sticking, 4u);
  for (int k = 0; k < 300; ++k) ASSERT_EQ(proxy.step(Vec3(5.0, 0.0, 0.0)), ProxyFault::none);  // breaks away and slides
  EXPECT_GT(proxy.q().x(), 0.02);
  EXPECT_LE(proxy.first_order_steps(), sticking + 4u);

  models::FreeSpace<3> space;
  AdmittanceProxy<3> free({.mass_kg = 4.0, .order = 2}, space);
  for (int k = 0; k < 300; ++k) ASSERT_EQ(free.step(Vec3(std::sin(0.05 * k), 0.0, 1.0)), ProxyFault::none);
  EXPECT_EQ(free.first_order_steps(), 0u);
}

// White noise of 1 N on h, as noise of the proxy's acceleration at 1 kg: 1 m/s² with (26), and √(13² + 2² + 1²)/12
// = 1.10 with Störmer's correction.
TEST(RenderedModels, OrderTwoAmplifiesNoiseByATenth) {
  const auto noise = [](int order) {
    Random random(103);
    models::FreeSpace<3> space;
    AdmittanceProxy<3> proxy({.mass_kg = 1.0, .order = order}, space);
    double sum = 0.0;
    Vec3 v1 = Vec3::Zero();
    const int steps = 20000;
    for (int k = 0; k < steps; ++k) {
      EXPECT_EQ(proxy.step(random_vector(random, std::sqrt(3.0))), ProxyFault::none);
      sum += ((proxy.velocity() - v1) / 1e-3).squaredNorm() / 3.0;
      v1 = proxy.velocity();
    }
    return std::sqrt(sum / steps);
  };
  EXPECT_NEAR(noise(1), 1.0, 0.03);
  EXPECT_NEAR(noise(2), std::sqrt(174.0) / 12.0, 0.03);
}

// A mesh holds from both sides. Order 2 may look from a point that is a third of a step ahead of the proxy, which must
// not lead behind a face.
TEST(RenderedModels, OrderTwoStaysOutOfAMesh) {
  Random random(104);
  const double half = 0.1;
  const auto mesh = std::make_shared<const models::TriangleMesh>(tests::block(Vec3::Constant(2.0 * half)));
  for (std::int64_t run = 0; run < scaled(2000); ++run) {
    models::MeshSurface g(mesh, random.chance(0.3) ? 0.0 : random.uniform(0.0, 1.0));
    const double M = random.log_uniform(0.01, 100), T = random.log_uniform(1e-3, 14e-3);
    AdmittanceProxy<3> proxy({.mass_kg = M, .period_s = T, .order = 2}, g);
    Vec3 q = random_vector(random, 0.2);
    q[random.below(3)] = half + random.log_uniform(1e-4, 0.1);
    ASSERT_TRUE(proxy.start({.q = q, .v = random.log_uniform(1e-3, 10.0) * random.direction<3>()}));
    Vec3 h = Vec3::Zero();
    for (int k = 0; k < 100; ++k) {
      if (k % 10 == 0) h = random.log_uniform(1e-4, 0.1) * M / (T * T) * random.direction<3>();
      // Back to the block, as a spring that the timestep carries would.
      ASSERT_EQ(proxy.step(h - 0.01 * M / (T * T) * proxy.q()), ProxyFault::none);
      ASSERT_GE(proxy.q().cwiseAbs().maxCoeff(), half - 1e-15) << "run " << run << ", step " << k;
    }
  }
}

}  // namespace
}  // namespace proxarm::controller
