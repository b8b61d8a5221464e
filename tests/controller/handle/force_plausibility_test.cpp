// The story: with a force sensor of the wrong sign a hand pushed the handle on by its own stiffness, for 0.38 m and up
// to 196 N; a sensor that drifted led an empty handle through the room.
#include "controller/handle/force_plausibility.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace proxarm::controller {
namespace {

using models::Vec3;

constexpr double T = 1e-3, noise_N = 0.02;

// A mass that a force moves, as (26) does in free space.
struct Moved {
  explicit Moved(double its_mass_kg) : mass_kg(its_mass_kg) {}
  [[nodiscard]] ForceAndMotion under(const Vec3& hand_N) {
    force = hand_N;
    for (int i = 0; i < 3; ++i) force[i] += noise(generator);
    v = (mass_kg * v + T * force) / (mass_kg + T * damping_Ns_per_m);
    q += T * v;
    return {
        .force_W = force, .q_W = q, .v_W = v, .mass_kg = mass_kg, .damping_Ns_per_m = damping_Ns_per_m, .period_s = T};
  }
  double mass_kg, damping_Ns_per_m = 0.0;
  Vec3 q = Vec3::Zero(), v = Vec3::Zero(), force = Vec3::Zero();
  std::mt19937 generator{3};
  std::normal_distribution<double> noise{0.0, noise_N};
};

// Where a hand wants to be: minimum jerk to d within duration.
double wanted(double t, double d, double duration_s) {
  const double s = std::min(1.0, t / duration_s);
  return d * s * s * s * (10.0 - 15.0 * s + 6.0 * s * s);
}

TEST(ReversedForce, IsFoundWithinAFewCentimetresWhateverTheGripAndTheMass) {
  for (const double mass_kg : {2.0, 4.0, 10.0}) {
    for (const double stiffness : {100.0, 500.0, 3000.0}) {
      Moved arm(mass_kg);
      ReversedForce reversed;
      bool found = false;
      for (int k = 0; k < 5'000 && !found; ++k) {
        const Vec3 hand =
            stiffness * (Vec3(0.0, wanted(k * T, 0.2, 3.0), 0.0) - arm.q) - 0.8 * std::sqrt(stiffness) * arm.v;
        found = reversed.step(arm.under(-hand));
      }
      EXPECT_TRUE(found) << mass_kg << " kg, " << stiffness << " N/m";
      EXPECT_LT(arm.q.norm(), 0.066) << mass_kg << " kg, " << stiffness << " N/m";
    }
  }
}

// 2000 hands that begin to lead; the arm has a damping of its own between these, or none.
void expect_no_hand_is_reversed(unsigned seed, double least_Ns_per_m, double most_Ns_per_m) {
  std::mt19937 generator{seed};
  const auto random = [&](double low, double high) {
    return std::exp(std::uniform_real_distribution<double>(std::log(low), std::log(high))(generator));
  };
  for (int i = 0; i < 2'000; ++i) {
    Moved arm(random(2.0, 20.0));
    if (most_Ns_per_m > 0.0) arm.damping_Ns_per_m = random(least_Ns_per_m, most_Ns_per_m);
    ReversedForce reversed;
    const double stiffness = random(50.0, 3000.0), damping = random(0.3, 1.5) * std::sqrt(stiffness * arm.mass_kg);
    const double d = random(0.02, 0.5), duration_s = random(0.4, 6.0);
    for (int k = 0; k < 3'000; ++k) {
      const Vec3 hand = stiffness * (Vec3(wanted(k * T, d, duration_s), 0.0, 0.0) - arm.q) - damping * arm.v;
      ASSERT_FALSE(reversed.step(arm.under(hand))) << i << ": " << stiffness << " N/m, " << d << " m in " << duration_s
                                                   << ", " << arm.damping_Ns_per_m << " Ns/m";
    }
  }
}

TEST(ReversedForce, IsNoneThatAHandMakesHoweverItBegins) { expect_no_hand_is_reversed(11, 0.0, 0.0); }

// A soak's session: behind a passivity damping of 836 Ns/m a hand of 449 N/m led 6 kg, its force grew by 1.47 to 1.54.
TEST(ReversedForce, IsNoneThatAHandMakesAgainstDamping) { expect_no_hand_is_reversed(12, 10.0, 2000.0); }

// A soak's session: 281 N/m led 10 kg out of rest. The force of minimum jerk begins as t³, whatever takes hold: it
// grows by 2^(3/5) = 1.52 each time the way has doubled.
TEST(ReversedForce, IsNoneThatSetsOutAsTheCubeOfTime) {
  for (const double rate_N_per_s3 : {30.0, 300.0, 1000.0, 5000.0}) {
    for (const double mass_kg : {2.0, 4.0, 10.0}) {
      Moved arm(mass_kg);
      ReversedForce reversed;
      for (int k = 0; arm.q.norm() < 0.1; ++k) {
        const double t = k * T;
        ASSERT_FALSE(reversed.step(arm.under(Vec3(rate_N_per_s3 * t * t * t, 0.0, 0.0))))
            << rate_N_per_s3 << " N/s³, " << mass_kg << " kg, " << arm.q.norm() << " m";
      }
    }
  }
}

TEST(ReversedForce, IsFoundBehindDampingToo) {
  for (const double damping : {20.0, 100.0}) {
    Moved arm(4.0);
    arm.damping_Ns_per_m = damping;
    ReversedForce reversed;
    bool found = false;
    for (int k = 0; k < 20'000 && !found; ++k) {
      found = reversed.step(arm.under(500.0 * (arm.q - Vec3(0.0, wanted(k * T, 0.2, 3.0), 0.0))));
    }
    EXPECT_TRUE(found) << damping << " Ns/m";
    EXPECT_LT(arm.q.norm(), 0.066) << damping << " Ns/m";
  }
}

TEST(ReversedForce, IsNotJudgedWhileSomethingIsTouched) {
  Moved arm(4.0);
  ReversedForce reversed;
  for (int k = 0; k < 1'000; ++k) {
    ForceAndMotion now = arm.under(500.0 * (arm.q + Vec3(1e-4, 0.0, 0.0)));
    now.free = false;
    ASSERT_FALSE(reversed.step(now));
  }
}

// By how far an empty handle goes until it is found; the session's length where it isn't.
struct Led {
  bool found = false;
  double way_m = 0.0;
};
template <typename Force>
Led led(const Force& force, double time_s = 5.0) {
  Moved arm(4.0);
  StraightForce straight;
  Led result;
  bool empty = true;
  for (int k = 0; k < std::lround(time_s / T) && !result.found; ++k) {
    const Vec3 hand = force(k * T);
    empty = empty && hand.norm() < 0.15;
    if (empty) arm.v = Vec3::Zero();
    result.found = straight.step(arm.under(hand), empty, noise_N);
    result.way_m = arm.q.norm();
  }
  return result;
}

TEST(StraightForce, IsADriftOrAJumpOfAnEmptyHandle) {
  for (const double rate : {0.5, 1.0, 2.0, 5.0}) {
    const Led drift = led([&](double t) { return Vec3(0.0, rate * t, 0.0); });
    EXPECT_TRUE(drift.found) << rate;
    EXPECT_LT(drift.way_m, 0.09) << rate;
  }
  for (const double jump : {1.0, 5.0, 20.0}) {
    const Led offset = led([&](double t) { return Vec3(t > 0.5 ? jump : 0.0, 0.0, 0.0); });
    EXPECT_TRUE(offset.found) << jump;
    EXPECT_LT(offset.way_m, 0.02) << jump;
  }
}

TEST(StraightForce, IsNoneOfAHandThatTakesHoldOfTheHandle) {
  for (const double duration_s : {0.5, 1.0, 2.0}) {
    for (const double d : {0.05, 0.2, 0.5}) {
      // What accelerates 4 kg to there by minimum jerk.
      const Led hand = led(
          [&](double t) {
            const double s = std::min(1.0, t / duration_s);
            return Vec3(4.0 * d / (duration_s * duration_s) * (60.0 * s - 180.0 * s * s + 120.0 * s * s * s), 0.0, 0.0);
          },
          duration_s);
      EXPECT_FALSE(hand.found) << d << " m in " << duration_s << " s";
    }
  }
}

TEST(StraightForce, IsNotJudgedWhereSomebodyHeldTheHandle) {
  Moved arm(4.0);
  StraightForce straight;
  for (int k = 0; k < 2'000; ++k) ASSERT_FALSE(straight.step(arm.under(Vec3(0.3, 0.0, 0.0)), false, noise_N));
}

}  // namespace
}  // namespace proxarm::controller
