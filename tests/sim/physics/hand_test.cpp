#include "sim/physics/hand.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/sim/cell/default_cell.hpp"

namespace proxarm::sim {
namespace {

using models::Vec3;

models::Pose at(const Vec3& place) { return models::Pose(Eigen::Translation3d(place)); }

description::HandDescription two_points() {
  description::HandDescription hand;
  hand.waypoints = {{1.0, {0.0, 0.0, 0.0}}, {3.0, {0.2, -0.1, 0.0}}};
  return hand;
}

TEST(Hand, RestsBeforeItsFirstWaypointAndAfterItsLast) {
  const Vec3 start(0.7, 0.0, 0.6);
  const Hand hand(two_points(), at(start));
  EXPECT_EQ(hand.intention(-1.0).position_W, start);
  EXPECT_EQ(hand.intention(1.0).position_W, start);
  EXPECT_EQ(hand.intention(1.0).velocity_W, Vec3::Zero());
  EXPECT_EQ(hand.intention(3.0).position_W, start + Vec3(0.2, -0.1, 0.0));
  EXPECT_EQ(hand.intention(99.0).velocity_W, Vec3::Zero());
}

// Minimum jerk (Flash and Hogan 1985): half way at half time, with 15/8 of the mean speed.
TEST(Hand, MovesWithMinimumJerkBetweenWaypoints) {
  const Hand hand(two_points(), at(Vec3::Zero()));
  const Intention middle = hand.intention(2.0);
  EXPECT_LT((middle.position_W - Vec3(0.1, -0.05, 0.0)).norm(), 1e-15);
  EXPECT_LT((middle.velocity_W - 1.875 * Vec3(0.1, -0.05, 0.0)).norm(), 1e-15);
}

TEST(Hand, HoldsTheStartWithoutWaypoints) {
  const Hand hand(description::HandDescription{}, at(Vec3(1.0, 2.0, 3.0)));
  EXPECT_EQ(hand.intention(5.0).position_W, Vec3(1.0, 2.0, 3.0));
  EXPECT_EQ(hand.force_W(5.0, Vec3(1.0, 2.0, 3.0), Vec3::Zero()), Vec3::Zero());
}

// The grip's stiffness, from what it pulls with a millimetre away.
double stiffness_at(const Hand& hand, double time_s) {
  return 1000.0 * hand.force_W(time_s, Vec3(-1e-3, 0.0, 0.0), Vec3::Zero()).x();
}

TEST(Hand, VariesBetweenTheBoundsThatWereAskedForAndReachesThem) {
  description::HandDescription description;
  description.variation = {.share = 0.4, .interval_s = 0.1, .seed = 7};
  const Hand hand(description, at(Vec3::Zero()));
  EXPECT_NEAR(stiffness_at(hand, 0.0), 500.0, 1e-9);
  double least = 1e9, most = 0.0, sum = 0.0, last = 500.0, fastest = 0.0;
  constexpr int samples = 200'000;
  for (int k = 0; k < samples; ++k) {
    const double now = stiffness_at(hand, 1e-3 * k);
    least = std::min(least, now);
    most = std::max(most, now);
    sum += now;
    fastest = std::max(fastest, std::abs(now - last));
    last = now;
  }
  // 2,000 draws: one within 2 % of each end but for (1 − 0.01)^2000 = 2e-9.
  EXPECT_GE(least, 300.0 - 1e-9);
  EXPECT_LT(least, 304.0);
  EXPECT_LE(most, 700.0 + 1e-9);
  EXPECT_GT(most, 696.0);
  // Evenly distributed: deviation 400/√12 of each, five of their mean's.
  EXPECT_NEAR(sum / samples, 500.0, 5.0 * 400.0 / std::sqrt(12.0) / std::sqrt(2000.0));
  EXPECT_LE(fastest, 1.875 * 400.0 * 0.01 + 1e-9);  // minimum jerk's top speed, in a hundredth of the interval
}

TEST(Hand, VariesTheSameForTheSameSeedOnlyAndItsDampingWithIt) {
  description::HandDescription description;
  description.variation = {.share = 0.4, .interval_s = 0.5, .seed = 7};
  const Hand hand(description, at(Vec3::Zero())), same(description, at(Vec3::Zero()));
  description.variation.seed = 8;
  const Hand other(description, at(Vec3::Zero()));
  for (double t = 0.25; t < 20.0; t += 0.5) {
    EXPECT_EQ(stiffness_at(hand, t), stiffness_at(same, t));
    EXPECT_NE(stiffness_at(hand, t), stiffness_at(other, t));
    const double damping = -hand.force_W(t, Vec3::Zero(), Vec3::UnitX()).x();
    EXPECT_NEAR(damping / 20.0, stiffness_at(hand, t) / 500.0, 1e-12);
  }
  EXPECT_NEAR(tightest_grip(description).stiffness_N_per_m, 700.0, 1e-9);
  EXPECT_NEAR(tightest_grip(description).damping_Ns_per_m, 28.0, 1e-9);
}

TEST(Hand, HasTheVelocityThatIsItsPositionsDerivative) {
  constexpr unsigned seed = 4711;
  std::mt19937 random(seed);
  description::HandDescription description = two_points();
  description.multisine = {{.frequency_Hz = 0.5, .amplitude_m = 0.01, .phase_rad = 0.3, .direction = {1.0, 0.0, 0.0}},
                           {.frequency_Hz = 1.7, .amplitude_m = 0.02, .phase_rad = -1.0, .direction = {0.0, 0.6, 0.8}}};
  const Hand hand(description, at(Vec3(0.7, 0.0, 0.6)));
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
  const Hand hand(description, at(Vec3::Zero()));
  const Vec3 force = hand.force_W(0.0, Vec3(0.01, 0.0, 0.0), Vec3(0.0, 0.3, 0.0));
  EXPECT_LT((force - Vec3(-4.0, -3.0, 0.0)).norm(), 1e-14);
}

TEST(Hand, PullsNoHarderThanItCan) {
  description::HandDescription weak;
  weak.stiffness_N_per_m = 400.0;
  weak.damping_Ns_per_m = 10.0;
  weak.max_force_N = 50.0;
  const Hand hand(weak, at(Vec3::Zero()));
  // 400 N/m · 0.1 m = 40 N, and 10 Ns/m · 0.5 m/s = 5 N: as it is. A metre would be 400 N, along the same line.
  EXPECT_LT((hand.force_W(0.0, Vec3(-0.1, 0.0, 0.0), Vec3(-0.5, 0.0, 0.0)) - Vec3(45.0, 0.0, 0.0)).norm(), 1e-12);
  EXPECT_LT((hand.force_W(0.0, Vec3(-0.6, 0.0, 0.8), Vec3::Zero()) - Vec3(30.0, 0.0, -40.0)).norm(), 1e-12);
}

// ---- motions and forces as data -------------------------------------------------------------------------------------

description::HandDescription with_trajectory() {
  description::HandDescription hand;
  hand.trajectory = {{0.5, {0, 0, 0}}, {0.9, {0.01, 0, 0.02}}, {1.0, {0.03, -0.01, 0}}, {1.6, {0.02, 0.05, 0.01}}};
  return hand;
}

TEST(Hand, GoesThroughTheRowsOfItsTrajectoryAndRestsAtBothEnds) {
  const Vec3 start(0.7, 0.0, 0.6);
  const Hand hand(with_trajectory(), at(start));
  for (const description::TimedVector& row : with_trajectory().trajectory) {
    EXPECT_LT((hand.intention(row.time_s).position_W - start - Vec3(row.value.data())).norm(), 1e-15) << row.time_s;
  }
  EXPECT_EQ(hand.intention(-1.0).position_W, start);
  EXPECT_EQ(hand.intention(0.5).velocity_W, Vec3::Zero());
  EXPECT_LT((hand.intention(9.0).position_W - start - Vec3(0.02, 0.05, 0.01)).norm(), 1e-15);
  EXPECT_EQ(hand.intention(9.0).velocity_W, Vec3::Zero());
}

// A parabola's slopes are exact by three points, and a cubic holds it: only the first and last span rest at their ends.
TEST(Hand, FollowsAParabolaExactlyWhateverTheRowsTimes) {
  const auto at = [](double t) { return Vec3(0.3 * t * t, -0.1 * t, 0.02 + 0.05 * t * (1.0 - t)); };
  description::HandDescription description;
  for (const double t : {0.0, 0.1, 0.17, 0.3, 0.31, 0.5, 0.8}) {
    const Vec3 x = at(t);
    description.trajectory.push_back({t, {x.x(), x.y(), x.z()}});
  }
  const Hand hand(description, models::Pose::Identity());
  for (double t = 0.1; t <= 0.5; t += 0.0123) {
    EXPECT_LT((hand.intention(t).position_W - at(t)).norm(), 1e-15) << t;
    EXPECT_LT((hand.intention(t).velocity_W - Vec3(0.6 * t, -0.1, 0.05 - 0.1 * t)).norm(), 1e-14) << t;
  }
}

TEST(Hand, HasTheVelocityThatIsItsTrajectorysDerivative) {
  const Hand hand(with_trajectory(), at(Vec3::Zero()));
  for (double t = 0.45; t < 1.7; t += 0.00377) {
    constexpr double h = 1e-6;  // slopes bend at rows: error h x''/2, with x'' below 10 m/s²
    const Vec3 slope = (hand.intention(t + h).position_W - hand.intention(t - h).position_W) / (2.0 * h);
    EXPECT_LT((slope - hand.intention(t).velocity_W).norm(), 1e-5) << t;
  }
}

TEST(Hand, ExertsTheForceOfItsDataBesideThatOfItsGrip) {
  description::HandDescription description;
  description.force = {{1.0, {2, 0, 0}}, {1.5, {4, -2, 0}}};
  description.stiffness_N_per_m = 100.0;
  description.damping_Ns_per_m = 0.0;
  const Hand hand(description, at(Vec3::Zero()));
  const auto force = [&](double t) { return hand.force_W(t, Vec3(0.01, 0, 0), Vec3::Zero()); };
  EXPECT_LT((force(0.9) - Vec3(-1, 0, 0)).norm(), 1e-14) << "not yet";
  EXPECT_LT((force(1.0) - Vec3(1, 0, 0)).norm(), 1e-14);
  EXPECT_LT((force(1.25) - Vec3(2, -1, 0)).norm(), 1e-14) << "half way";
  EXPECT_LT((force(1.5) - Vec3(3, -2, 0)).norm(), 1e-14);
  EXPECT_LT((force(1.51) - Vec3(-1, 0, 0)).norm(), 1e-14) << "not any more";
}

// The hands that come with the project start at rest on the handle, or the arm would feel a push when it wakes up.
TEST(Hand, ComesInFilesThatStartWithoutAForce) {
  for (const char* file : {"sim/hands/touch.yaml", "sim/hands/sweep.yaml", "sim/hands/wobble.yaml"}) {
    const Hand hand(description::load_hand(source_file(file)), at(Vec3::Zero()));
    EXPECT_LT(hand.force_W(0.0, Vec3::Zero(), Vec3::Zero()).norm(), 1e-9) << file;
    EXPECT_LT(hand.force_W(1e-6, Vec3::Zero(), Vec3::Zero()).norm(), 1.0)
        << file;  // its velocity may begin with a step
  }
}

description::HandDescription turning() {
  description::HandDescription hand;
  hand.turning_stiffness_Nm_per_rad = 20.0;
  hand.turning_damping_Nms_per_rad = 0.5;
  hand.waypoints = {{0.5, {}, {0.1, 0.0, 0.3}}, {2.5, {}, {-0.4, 0.7, 0.2}}};
  hand.multisine = {{.frequency_Hz = 1.3, .amplitude_rad = 0.1, .direction = {0.6, 0.0, 0.8}}};
  return hand;
}

// Followed exactly, it twists nothing: its angular velocity is its orientation's derivative.
TEST(Hand, DoesNotTwistAToolThatTurnsAsItIntends) {
  const models::Mat3 start = Eigen::AngleAxisd(0.7, Vec3(0.0, 0.6, 0.8)).toRotationMatrix();
  models::Pose X = models::Pose::Identity();
  X.linear() = start;
  const Hand hand(turning(), X);
  const auto orientation = [&](double t) -> models::Mat3 {
    const Vec3 phi = hand.intention(t).turn_W;
    return Eigen::AngleAxisd(phi.norm(), phi.normalized()).toRotationMatrix() * start;
  };
  for (double t = 0.05; t < 3.0; t += 0.05) {
    constexpr double h = 1e-5;  // error below 1e-8 rad/s (h² times a third derivative), rounding 1e-16/h = 1e-11
    const models::Mat3 rate = (orientation(t + h) - orientation(t - h)) / (2.0 * h) * orientation(t).transpose();
    const Vec3 omega(rate(2, 1), rate(0, 2), rate(1, 0));
    EXPECT_LT(hand.torque_W(t, orientation(t), omega).norm(), 1e-7) << t;
  }
}

TEST(Hand, TwistsThroughItsStiffnessAndDampingAndNoHarderThanItCan) {
  description::HandDescription description;
  description.turning_stiffness_Nm_per_rad = 20.0;
  description.turning_damping_Nms_per_rad = 0.5;
  const models::Mat3 turned = Eigen::AngleAxisd(0.1, Vec3::UnitY()).toRotationMatrix();
  const Vec3 torque = Hand(description, at(Vec3::Zero())).torque_W(0.0, turned, Vec3(0.0, 0.0, 2.0));
  EXPECT_LT((torque - Vec3(0.0, -2.0, -1.0)).norm(), 1e-13);
  description.max_torque_Nm = 1.0;
  EXPECT_NEAR(Hand(description, at(Vec3::Zero())).torque_W(0.0, turned, Vec3::Zero()).y(), -1.0, 1e-13);
  EXPECT_EQ(Hand(description::HandDescription{}, at(Vec3::Zero())).torque_W(0.0, turned, Vec3::Ones()), Vec3::Zero());
}

}  // namespace
}  // namespace proxarm::sim
