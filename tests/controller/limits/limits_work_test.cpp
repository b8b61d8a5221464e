// Which pushes of a limit are those of a brake, and which go against the hand?
#include "controller/limits/limits_work.hpp"

#include <gtest/gtest.h>

namespace proxarm::controller {
namespace {

constexpr double T = 1e-3, braking_s = 0.15;

LimitsWork judge() {
  LimitsWork out;
  out.set_braking(braking_s);
  out.start();
  return out;
}

// An arm of `mass_kg` that brakes from `speed` by `deceleration` while a hand pulls back with `pull_N`.
LimitsWork braked(double mass_kg, double speed, double deceleration, double pull_N) {
  LimitsWork work = judge();
  for (double v = speed; v > 0.0; v -= deceleration * T) {
    const double limit_N = pull_N - mass_kg * deceleration;  // along the motion: what keeps it from stopping at once
    work.step({.work_J = limit_N * v * T, .power_W = pull_N * v, .kinetic_J = 0.5 * mass_kg * v * v});
    if (work.against_the_hand()) break;
  }
  return work;
}

TEST(LimitsWork, AnArmThatBrakesAsHardAsItCanIsNoneThatPushes) {
  for (const double speed : {0.05, 0.25, 0.5}) {
    for (const double pull_N : {5.0, 40.0, 200.0}) {
      for (const double mass_kg : {1.0, 10.0}) {
        EXPECT_FALSE(braked(mass_kg, speed, speed / braking_s, pull_N).against_the_hand())
            << speed << " m/s, " << pull_N << " N, " << mass_kg << " kg";
      }
    }
  }
}

// The tool creeps against a hand: at any speed and force it is told before the hand has lost 50 mJ more than the arm's
// braking may cost.
TEST(LimitsWork, AnArmThatGoesOnAgainstTheHandIsTold) {
  for (const double speed : {0.01, 0.1, 0.5}) {
    for (const double pull_N : {5.0, 38.0, 150.0}) {
      LimitsWork work = judge();
      const double kinetic_J = 0.5 * 4.0 * speed * speed;
      double lost_J = 0.0;
      while (!work.against_the_hand() && lost_J < 100.0) {
        work.step({.work_J = pull_N * speed * T, .power_W = pull_N * speed, .kinetic_J = kinetic_J});
        lost_J += pull_N * speed * T;
      }
      EXPECT_LT(lost_J, 0.051 + kinetic_J + pull_N * speed * (braking_s + T)) << speed << " m/s, " << pull_N << " N";
    }
  }
}

TEST(LimitsWork, WhatALimitTakesPaysForWhatItGives) {
  LimitsWork work = judge();
  for (int k = 0; k < 100'000; ++k) work.step({.work_J = k % 2 == 0 ? -0.01 : 0.01, .power_W = 1.0, .kinetic_J = 0.0});
  EXPECT_FALSE(work.against_the_hand());
  EXPECT_NEAR(work.total_J(), 0.0, 1e-9);
  EXPECT_LE(work.push_J(), 0.01 + 1e-9);
}

// Energy that was taken long ago is none that may be given back: a spring would be.
TEST(LimitsWork, WhatWasTakenBeforeIsNotOwed) {
  LimitsWork work = judge();
  for (int k = 0; k < 1000; ++k) work.step({.work_J = -1.0, .power_W = 10.0, .kinetic_J = 0.1});
  int cycles = 0;
  for (; cycles < 1000 && !work.against_the_hand(); ++cycles) {
    work.step({.work_J = 0.1, .power_W = 1.0, .kinetic_J = 0.01});
  }
  EXPECT_LT(cycles, 10);
}

}  // namespace
}  // namespace proxarm::controller
