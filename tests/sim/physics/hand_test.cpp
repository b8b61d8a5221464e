#include "sim/physics/hand.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/sim/cell/default_cell.hpp"

namespace proxarm::sim {
namespace {

using models::Vec3;

description::HandDescription two_points() {
  description::HandDescription hand;
  hand.waypoints = {{1.0, {0.0, 0.0, 0.0}}, {3.0, {0.2, -0.1, 0.0}}};
  return hand;
}

TEST(Hand, RestsBeforeItsFirstWaypointAndAfterItsLast) {
  const Vec3 start(0.7, 0.0, 0.6);
  const Hand hand(two_points(), start);
  EXPECT_EQ(hand.intention(-1.0).position_W, start);
  EXPECT_EQ(hand.intention(1.0).position_W, start);
  EXPECT_EQ(hand.intention(1.0).velocity_W, Vec3::Zero());
  EXPECT_EQ(hand.intention(3.0).position_W, start + Vec3(0.2, -0.1, 0.0));
  EXPECT_EQ(hand.intention(99.0).velocity_W, Vec3::Zero());
}

// Minimum jerk (Flash and Hogan 1985): half way at half time, with 15/8 of the mean speed.
TEST(Hand, MovesWithMinimumJerkBetweenWaypoints) {
  const Hand hand(two_points(), Vec3::Zero());
  const Intention middle = hand.intention(2.0);
  EXPECT_LT((middle.position_W - Vec3(0.1, -0.05, 0.0)).norm(), 1e-15);
  EXPECT_LT((middle.velocity_W - 1.875 * Vec3(0.1, -0.05, 0.0)).norm(), 1e-15);
}

TEST(Hand, HoldsTheStartWithoutWaypoints) {
  const Hand hand(description::HandDescription{}, Vec3(1.0, 2.0, 3.0));
  EXPECT_EQ(hand.intention(5.0).position_W, Vec3(1.0, 2.0, 3.0));
  EXPECT_EQ(hand.force_W(5.0, Vec3(1.0, 2.0, 3.0), Vec3::Zero()), Vec3::Zero());
}

TEST(Hand, HasTheVelocityThatIsItsPositionsDerivative) {
  constexpr unsigned seed = 4711;
  std::mt19937 random(seed);
  description::HandDescription description = two_points();
  description.multisine = {{0.5, 0.01, 0.3, {1.0, 0.0, 0.0}}, {1.7, 0.02, -1.0, {0.0, 0.6, 0.8}}};
  const Hand hand(description, Vec3(0.7, 0.0, 0.6));
  for (int n = 0; n < scaled(1000); ++n) {
    const double t = std::uniform_real_distribution(0.01, 5.0)(random);
    constexpr double h = 1e-5;  // error h² x'''/6 below 1e-9 m/s, rounding 1e-16/h = 1e-11
    const Vec3 slope = (hand.intention(t + h).position_W - hand.intention(t - h).position_W) / (2.0 * h);
    EXPECT_LT((slope - hand.intention(t).velocity_W).norm(), 1e-8) << "seed " << seed << ", t " << t;
  }
}

TEST(Hand, PullsThroughItsStiffnessAndDamping) {
  description::HandDescription description;
  description.stiffness_N_per_m = 400.0;
  description.damping_Ns_per_m = 10.0;
  const Hand hand(description, Vec3::Zero());
  const Vec3 force = hand.force_W(0.0, Vec3(0.01, 0.0, 0.0), Vec3(0.0, 0.3, 0.0));
  EXPECT_LT((force - Vec3(-4.0, -3.0, 0.0)).norm(), 1e-14);
}

TEST(Hand, PullsNoHarderThanItCan) {
  description::HandDescription weak;
  weak.stiffness_N_per_m = 400.0;
  weak.damping_Ns_per_m = 10.0;
  weak.max_force_N = 50.0;
  const Hand hand(weak, Vec3::Zero());
  // 400 N/m · 0.1 m = 40 N, and 10 Ns/m · 0.5 m/s = 5 N: as it is. A metre would be 400 N, along the same line.
  EXPECT_LT((hand.force_W(0.0, Vec3(-0.1, 0.0, 0.0), Vec3(-0.5, 0.0, 0.0)) - Vec3(45.0, 0.0, 0.0)).norm(), 1e-12);
  EXPECT_LT((hand.force_W(0.0, Vec3(-0.6, 0.0, 0.8), Vec3::Zero()) - Vec3(30.0, 0.0, -40.0)).norm(), 1e-12);
}

// The hands that come with the project start at rest on the handle, or the arm would feel a push when it wakes up.
TEST(Hand, ComesInFilesThatStartWithoutAForce) {
  for (const char* file : {"sim/hands/touch.yaml", "sim/hands/sweep.yaml"}) {
    const Hand hand(description::load_hand(source_file(file)), Vec3::Zero());
    EXPECT_LT(hand.force_W(0.0, Vec3::Zero(), Vec3::Zero()).norm(), 1e-9) << file;
    EXPECT_LT(hand.force_W(1e-6, Vec3::Zero(), Vec3::Zero()).norm(), 1.0)
        << file;  // its velocity may begin with a step
  }
}

}  // namespace
}  // namespace proxarm::sim
