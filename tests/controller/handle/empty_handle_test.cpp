// The story: a proxy without a hand kept its speed for as long as nothing stopped it, and the sensor's bias of some
// millinewtons led an empty handle through the room, 0.83 m in a minute.
#include "controller/handle/empty_handle.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace proxarm::controller {
namespace {

using models::Vec3;
using models::Wrench;

constexpr double T = 1e-3, noise_N = 0.02, tool_kg = 0.25, mass_kg = 4.0;

// A mass in free space that the handle moves, and a sensor with the default cell's noise.
struct EmptyHandleTest : ::testing::Test {
  // One cycle under this force of a hand: the sensor reads it, noise, a bias, and the inertia of the tool.
  void cycle(const Vec3& hand_N) {
    Wrench reading{hand_N + bias_N - tool_kg * acceleration, Vec3::Zero()};
    for (int i = 0; i < 3; ++i) reading.force[i] += noise(generator);
    const bool empty = handle.step({.hand_W = reading, .noise_N = noise_N, .tare_samples = 200.0, .v_W = v});
    const Vec3 force = empty ? handle.braking_force_W(mass_kg, v) : reading.force;
    acceleration = force / mass_kg;
    v += T * acceleration;
    x += T * v;
  }
  void cycles(double time_s, const Vec3& hand_N) {
    for (int k = 0; k < std::lround(time_s / T); ++k) cycle(hand_N);
  }

  EmptyHandle handle{{.band_N = 0.1, .tool_mass_kg = tool_kg}, T};
  Vec3 x = Vec3::Zero(), v = Vec3::Zero(), acceleration = Vec3::Zero(), bias_N = Vec3::Zero();
  std::mt19937 generator{7};
  std::normal_distribution<double> noise{0.0, noise_N};
};

TEST_F(EmptyHandleTest, ComesToRestWithinADecimetreOfWhereItWasLetGo) {
  for (const double speed : {0.02, 0.1, 0.45, 0.9}) {
    handle.start();
    v = Vec3(0.0, speed, 0.0);
    x.setZero();
    cycles(4.0, Vec3::Zero());
    EXPECT_TRUE(handle.empty()) << speed;
    // v · the time until it counts as empty, v²/2a, and what is left decays with 0.07 s.
    EXPECT_LT(x.norm(), speed <= 0.45 ? 0.1 : 0.25) << speed;
    EXPECT_LT(v.norm(), 1e-9) << speed;
  }
}

TEST_F(EmptyHandleTest, StaysForTenMinutesWhateverBiasWithinTheBand) {
  bias_N = Vec3(0.05, -0.04, 0.03);
  cycles(600.0, Vec3::Zero());
  // While it isn't known yet: a t²/2 = 20 mm with 0.07 N, 4 kg and 1.5 s, and 2 mm to brake 27 mm/s with 0.07 s.
  EXPECT_LT(x.norm(), 0.023);
  EXPECT_TRUE(handle.rests());
}

TEST_F(EmptyHandleTest, IsTakenHoldOfWithinAFewCentisecondsByASmallForce) {
  cycles(3.0, Vec3::Zero());
  ASSERT_TRUE(handle.empty());
  int waited = 0;
  while (handle.empty() && waited < 1000) {
    cycle(Vec3(0.3, 0.0, 0.0));
    ++waited;
  }
  EXPECT_LT(waited, 40);
  cycles(0.3, Vec3(0.1, 0.0, 0.0));
  EXPECT_FALSE(handle.empty()) << "it isn't empty again at once";
  EXPECT_GT(v.x(), 0.0);
}

TEST_F(EmptyHandleTest, IsNotEmptyWhileAHandAcceleratesAndBrakesIt) {
  // To and fro at 1 Hz: the force passes through nothing at the highest speed, 0.16 m/s.
  for (int k = 0; k < 10'000; ++k) {
    cycle(Vec3(mass_kg * std::cos(2.0 * M_PI * k * T), 0.0, 0.0));
    ASSERT_FALSE(handle.empty()) << k;
  }
}

TEST_F(EmptyHandleTest, IsStillEmptyWhenTheToolRingsFromItsOwnBraking) {
  v = Vec3(0.45, 0.0, 0.0);
  int begun = 0, changes = 0;
  bool was = false;
  for (int k = 0; k < 2'000; ++k) {
    cycle(Vec3(0.4 * std::exp(-k * T / 0.05) * std::sin(2.0 * M_PI * 15.0 * k * T), 0.0, 0.0));
    changes += handle.empty() != was ? 1 : 0;
    was = handle.empty();
    begun = was ? begun : k;
  }
  EXPECT_EQ(changes, 1) << "once found, it stays found; begun at cycle " << begun;
}

TEST_F(EmptyHandleTest, BrakesNoHarderThanItSaysAndBeginsGently) {
  v = Vec3(0.45, 0.0, 0.0);
  Vec3 before = Vec3::Zero();
  for (int k = 0; k < 2'000; ++k) {
    cycle(Vec3::Zero());
    if (!handle.empty()) continue;
    EXPECT_LE(acceleration.norm(), 4.0 + 1e-9);
    EXPECT_LE(acceleration.norm() - before.norm(), 80.0 * T + 1e-9) << k;
    before = acceleration;
  }
}

TEST_F(EmptyHandleTest, IsFoundWithoutNoiseAndWithMuchOfIt) {
  for (const double sigma : {0.0, 0.2}) {
    handle.start();
    v = x = Vec3::Zero();
    for (int k = 0; k < 3'000; ++k) {
      Wrench reading{Vec3::Zero(), Vec3::Zero()};
      for (int i = 0; i < 3; ++i) reading.force[i] = sigma / noise_N * noise(generator);
      handle.step({.hand_W = reading, .noise_N = sigma, .tare_samples = 200.0, .v_W = v});
    }
    EXPECT_TRUE(handle.empty()) << sigma;
  }
}

// What was taken for noise may have been a hand: 0.3 N at 0.2 m/s are one's, whatever the tare says.
TEST_F(EmptyHandleTest, ANoiseThatMayHaveBeenAHandHidesNone) {
  const Wrench hand{Vec3(0.3, 0.0, 0.0), Vec3::Zero()};
  for (const bool white : {true, false}) {
    handle.start();
    for (int k = 0; k < 1'000; ++k) {
      handle.step(
          {.hand_W = hand, .noise_N = 1.0, .noise_is_white = white, .tare_samples = 200.0, .v_W = Vec3(0.2, 0.0, 0.0)});
    }
    EXPECT_EQ(handle.empty(), white);
  }
}

TEST_F(EmptyHandleTest, AHandThatOnlyTurnsTheToolIsOneWhereItMayTurn) {
  EmptyHandle turning{{.band_N = 0.1, .tool_mass_kg = tool_kg, .lever_m = 0.1}, T};
  const Wrench twist{Vec3::Zero(), Vec3(0.0, 0.0, 0.1)};
  for (int k = 0; k < 3'000; ++k) {
    const HandSigns signs{.hand_W = twist, .noise_N = noise_N, .tare_samples = 200.0, .v_W = v};
    turning.step(signs);
    handle.step(signs);
  }
  EXPECT_FALSE(turning.empty());
  EXPECT_TRUE(handle.empty());
}

}  // namespace
}  // namespace proxarm::controller
