#include "controller/stability/stability.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <deque>
#include <random>
#include <string>

#include "controller/proxies/admittance_proxy.hpp"
#include "models/base/setup_error.hpp"
#include "tests/controller/rendering/small_worlds.hpp"

namespace proxarm::controller {
namespace {

constexpr double none = -1.0;

// Jury's conditions give the exact boundary for ideal drives and one period of delay: K_h T²/4 + D_h T/2.
TEST(Stability, AgreesWithJuryForIdealDrives) {
  for (const double K_h : {100.0, 1000.0, 10000.0}) {
    for (const double D_h : {1.0, 10.0, 100.0}) {
      for (const double T : {2.5e-4, 1e-3, 4e-3}) {
        const auto mass = smallest_stable_mass({K_h, D_h, 0.0}, {.period_s = T});
        if (D_h <= K_h * T * 0.5) continue;  // another condition rules there
        ASSERT_TRUE(mass);
        EXPECT_NEAR(*mass, K_h * T * T / 4 + D_h * T / 2, 1e-9 * *mass) << K_h << " " << D_h << " " << T;
      }
    }
  }
  EXPECT_NEAR(*smallest_stable_mass({1000.0, 10.0, 0.0}, {.period_s = 1e-3}), 5.25e-3, 1e-12);
}

// Smallest stable mass with ideal drives, d periods of delay, as computed elsewhere from eigenvalues; printed digits.
TEST(Stability, ReproducesTheTableOfDelays) {
  struct Row {
    int d;
    double K_h, D_h;
    std::array<double, 5> mass;  // T = 0.5, 1, 2, 4, 10 ms
  };
  const Row rows[] = {{2, 1000, 10, {0.00526, 0.0111, 0.025, 0.0667, none}},
                      {3, 1000, 10, {0.00875, 0.0192, 0.0484, 0.262, none}},
                      {5, 1000, 10, {0.0165, 0.0404, 0.204, none, none}},
                      {10, 3000, 20, {0.13, none, none, none, none}}};
  const std::array<double, 5> periods{0.5e-3, 1e-3, 2e-3, 4e-3, 10e-3};
  for (const Row& row : rows) {
    for (std::size_t i = 0; i < periods.size(); ++i) {
      const double T = periods[i];
      const auto mass = smallest_stable_mass({row.K_h, row.D_h, 0.0}, {.period_s = T, .delay_s = (row.d - 1) * T});
      if (row.mass[i] == none) {
        EXPECT_FALSE(mass) << "d " << row.d << " T " << T << ": " << *mass;
        continue;
      }
      ASSERT_TRUE(mass) << "d " << row.d << " T " << T;
      EXPECT_NEAR(*mass, row.mass[i], 0.006 * row.mass[i]) << "d " << row.d << " T " << T;  // half of the third digit
    }
  }
}

// With a hand that has mass, and drives of 1.6 ms: the first stable point of a grid of 20 masses a decade.
TEST(Stability, ReproducesTheTableOfHands) {
  struct Row {
    HandModel hand;
    std::array<double, 4> mass;  // L = 1, 4, 8, 16 ms
  };
  const Row rows[] = {{{200, 10, 0.5}, {0.25, 0.40, 0.50, 0.50}},
                      {{500, 20, 1.0}, {0.50, 0.79, 1.0, 1.0}},
                      {{1000, 30, 1.5}, {0.71, 1.3, 1.4, 1.6}},
                      {{3000, 40, 2.0}, {1.0, 1.6, 2.0, none}}};
  const std::array<double, 4> delays{1e-3, 4e-3, 8e-3, 16e-3};
  const auto first_on_grid = [](double boundary) {
    int i = -100;
    while (std::pow(10.0, i / 20.0) <= boundary) ++i;
    return std::pow(10.0, i / 20.0);
  };
  for (const Row& row : rows) {
    for (std::size_t i = 0; i < delays.size(); ++i) {
      const LoopModel loop{.period_s = 1e-3, .delay_s = delays[i], .drive_time_constant_s = 1.6e-3};
      const auto mass = smallest_stable_mass(row.hand, loop, 316.0);
      if (row.mass[i] == none) {
        EXPECT_FALSE(mass);
        LoopModel damped = loop;
        damped.damping_Ns_per_m = 20.0;
        for (const bool explicit_damping : {true, false}) {
          damped.explicit_damping = explicit_damping;
          const auto helped = smallest_stable_mass(row.hand, damped, 316.0);
          ASSERT_TRUE(helped);
          EXPECT_NEAR(first_on_grid(*helped), 2.0, 0.01) << (explicit_damping ? "explicit" : "implicit");
        }
        continue;
      }
      ASSERT_TRUE(mass);
      // Two digits are printed.
      EXPECT_NEAR(first_on_grid(*mass), row.mass[i], row.mass[i] < 1.0 ? 0.005 : 0.05)
          << row.hand.stiffness_N_per_m << " N/m, L " << delays[i] << ", boundary " << *mass;
    }
  }
}

// The model against the integrator itself: run the loop with AdmittanceProxy in free space and a hand made of past
// positions, and see it grow or fade.
bool fades(const HandModel& hand, const LoopModel& loop, double proxy_mass_kg) {
  testing::Nothing<1> space;
  AdmittanceProxy<1> proxy({.mass_kg = proxy_mass_kg,
                            .damping_Ns_per_m = loop.damping_Ns_per_m,
                            .spring_N_per_m = loop.spring_N_per_m,
                            .period_s = loop.period_s,
                            .order = loop.order},
                           space);
  const double T = loop.period_s, m = hand.mass_kg + loop.handle_mass_kg;
  const double beta = loop.drive_time_constant_s > 0 ? std::exp(-T / loop.drive_time_constant_s) : 0.0;
  const auto lag = static_cast<std::size_t>(std::lround(loop.delay_s / T));
  std::deque<double> p(lag + 4, 0.0);  // p[i] is p(k − 1 − i)
  double early = 0.0, late = 0.0;
  const int steps = 40000;
  for (int k = 0; k < steps; ++k) {
    const double p1 = p[lag], p2 = p[lag + 1], p3 = p[lag + 2];
    const double h = -hand.stiffness_N_per_m * p1 - hand.damping_Ns_per_m * (p1 - p2) / T -
                     m * (p1 - 2 * p2 + p3) / (T * T) + (k == 0 ? 1.0 : 0.0);
    if (proxy.step(models::Vec<1>(h)) != ProxyFault::none) return false;
    const double q = proxy.q()[0];
    if (std::abs(q) > 1e6) return false;
    p.push_front((1 - beta) * q + beta * p.front());
    p.pop_back();
    if (k >= steps / 4 && k < steps / 2) early = std::max(early, std::abs(q));
    if (k >= 3 * steps / 4) late = std::max(late, std::abs(q));
  }
  return late < early || late == 0.0;
}

// Draws from the generator, whose seed each test prints.
auto log_uniform_from(std::mt19937_64& generator) {
  return [&generator](double low, double high) {
    return std::exp(std::uniform_real_distribution<>(std::log(low), std::log(high))(generator));
  };
}

TEST(Stability, PredictsWhatTheIntegratorDoes) {
  std::mt19937_64 generator(9);
  std::printf("seed 9\n");
  const auto log_uniform = log_uniform_from(generator);
  int stable = 0, unstable = 0;
  for (int run = 0; run < 120; ++run) {
    const HandModel hand{log_uniform(100, 5000), log_uniform(3, 80), run % 3 == 0 ? 0.0 : log_uniform(0.1, 3)};
    const LoopModel loop{.period_s = 1e-3,
                         .delay_s = 1e-3 * (run % 6),
                         .drive_time_constant_s = run % 2 == 0 ? 0.0 : log_uniform(5e-4, 8e-3),
                         .handle_mass_kg = run % 4 == 0 ? 0.0 : 0.3,
                         .damping_Ns_per_m = run % 5 == 0 ? 0.0 : 15.0,
                         .spring_N_per_m = run % 7 == 0 ? 200.0 : 0.0,
                         .order = 1 + run % 2,
                         .with_events = false};
    const double mass = log_uniform(0.05, 20);
    const double radius = spectral_radius(hand, loop, mass);
    // So near to the boundary 40,000 steps don't tell.
    if (std::abs(radius - 1) < 2e-4) continue;
    EXPECT_EQ(fades(hand, loop, mass), radius < 1) << "run " << run << " radius " << radius << " mass " << mass;
    (radius < 1 ? stable : unstable) += 1;
  }
  EXPECT_GT(stable, 20);
  EXPECT_GT(unstable, 20);
}

// At a wall order 2 is (26) in most of its steps, so what either of them can't bear is refused.
TEST(Stability, CountsTheEventsOfOrderTwo) {
  std::mt19937_64 generator(11);
  std::printf("seed 11\n");
  const auto log_uniform = log_uniform_from(generator);
  int heavier_by_events = 0;
  for (int run = 0; run < 40; ++run) {
    const HandModel hand{log_uniform(50, 5000), log_uniform(5, 80), log_uniform(0.01, 3)};
    LoopModel loop{.period_s = log_uniform(5e-4, 5e-3), .delay_s = log_uniform(1e-4, 1e-2), .order = 2};
    const auto both = smallest_stable_mass(hand, loop);
    loop.with_events = false;
    const auto free = smallest_stable_mass(hand, loop);
    loop.order = 1;
    const auto at_events = smallest_stable_mass(hand, loop);
    ASSERT_EQ(both.has_value(), free && at_events) << run;
    if (!both) continue;
    EXPECT_EQ(*both, std::max(*free, *at_events)) << run;
    heavier_by_events += *at_events > *free ? 1 : 0;
  }
  EXPECT_GT(heavier_by_events, 5);
}

// Everything above is stable, right below isn't: also where the stable masses are more than one interval. Checked
// against eigenvalues on a fine grid.
TEST(Stability, NamesTheMassAboveWhichAllAreStable) {
  std::mt19937_64 generator(10);
  std::printf("seed 10\n");
  const auto log_uniform = log_uniform_from(generator);
  int islands = 0;
  for (int run = 0; run < 60; ++run) {
    const HandModel hand{log_uniform(50, 20000), log_uniform(1, 300), log_uniform(0.01, 3)};
    const LoopModel loop{.period_s = log_uniform(5e-4, 5e-3),
                         .delay_s = log_uniform(1e-4, 2e-2),
                         .drive_time_constant_s = log_uniform(5e-4, 1e-2),
                         .damping_Ns_per_m = run % 2 == 0 ? 0.0 : log_uniform(1, 100),
                         .order = 1 + run % 2};
    const auto mass = smallest_stable_mass(hand, loop, 100.0);
    if (!mass) {
      EXPECT_GE(spectral_radius(hand, loop, 100.0), 1.0);
      continue;
    }
    bool was_stable = false, again_unstable = false;
    for (double m = 1e-3; m < 100.0; m *= 1.05) {
      const bool stable = spectral_radius(hand, loop, m) < 1.0;
      if (m > *mass * 1.0001) {
        ASSERT_TRUE(stable) << "run " << run << ": " << m << " above " << *mass;
      }
      again_unstable = again_unstable || (was_stable && !stable);
      was_stable = was_stable || stable;
    }
    islands += again_unstable;
    if (*mass > 1.1e-6) {
      EXPECT_GE(spectral_radius(hand, loop, *mass * 0.9999), 1.0 - 1e-9) << "run " << run;
    }
  }
  std::printf("%d loops have islands of stable masses\n", islands);
}

TEST(Stability, TimingOfTheSmallestStableMass) {
  const HandModel hand;
  // The default cell, and the longest loop that anyone would run: 16 ms at 4 kHz.
  for (const LoopModel& loop : {LoopModel{.delay_s = 2e-3, .drive_time_constant_s = 1.6e-3},
                                LoopModel{.period_s = 2.5e-4, .delay_s = 16e-3, .drive_time_constant_s = 1.6e-3}}) {
    double best_ms = 1e9;
    for (int i = 0; i < 5; ++i) {  // the best of them: others may use the machine, too
      const auto start = std::chrono::steady_clock::now();
      EXPECT_TRUE(smallest_stable_mass(hand, loop));
      const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - start;
      best_ms = std::min(best_ms, took.count());
    }
    std::printf("T %.2f ms, L %.0f ms: %.2f ms\n", 1e3 * loop.period_s, 1e3 * loop.delay_s, best_ms);
    EXPECT_LT(best_ms, 50.0);
  }
}

TEST(Stability, RefusesAMassWithTheSmallestThatIsStable) {
  const HandModel hand;  // 500 N/m, 20 Ns/m, 1 kg
  const LoopModel loop{.delay_s = 2e-3, .drive_time_constant_s = 1.6e-3, .handle_mass_kg = 0.25};
  const double boundary = *smallest_stable_mass(hand, loop) + 0.25;
  EXPECT_NO_THROW(require_stable_mass(4.0, hand, loop, false));
  EXPECT_NO_THROW(require_stable_mass(boundary * 0.9, hand, loop, true));
  try {
    require_stable_mass(boundary * 0.9, hand, loop, false);
    FAIL();
  } catch (const description::SetupError& error) {
    std::printf("%s\n", error.what());
    EXPECT_EQ(error.key(), "--mass");
    // The mass that it names is stable, and is no more than 10 % above the boundary (two digits, rounded up).
    const std::size_t at = error.expected().find("at least ");
    ASSERT_NE(at, std::string::npos);
    const double named = std::stod(error.expected().substr(at + 9));
    EXPECT_GE(named, boundary);
    EXPECT_LE(named, boundary * 1.1);
    EXPECT_NO_THROW(require_stable_mass(named, hand, loop, false));
  }
  for (const double mass : {0.25, 0.1, 0.0, -1.0, std::nan("")}) {
    EXPECT_THROW(require_stable_mass(mass, hand, loop, true), description::SetupError) << mass;
  }
  // No mass helps: K_h L beats D_h.
  const LoopModel slow{.delay_s = 50e-3, .drive_time_constant_s = 1.6e-3};
  try {
    require_stable_mass(50.0, hand, slow, false);
    FAIL();
  } catch (const description::SetupError& error) {
    std::printf("%s\n", error.what());
    EXPECT_NE(error.expected().find("none does"), std::string::npos);
  }
}

// The story: "add --damping" didn't say how much.
TEST(Stability, RefusesAMassWithTheDampingThatMakesItStable) {
  const HandModel hand;
  const auto advice = [&](double felt_mass_kg, const LoopModel& loop) {
    try {
      require_stable_mass(felt_mass_kg, hand, loop, false);
    } catch (const description::SetupError& error) {
      std::printf("%s\n", error.what());
      return error.problem().advice;
    }
    return std::string("none");
  };
  // Where K_h L beats D_h no mass is stable without damping. Those that are named are checked against the loop itself,
  // and two fifths of the damping are not enough.
  for (const double delay_s : {45e-3, 60e-3, 90e-3}) {
    LoopModel loop{.delay_s = delay_s, .drive_time_constant_s = 1.6e-3, .handle_mass_kg = 0.25};
    const std::string text = advice(50.0, loop);
    const std::size_t at = text.find("--damping "), mass_at = text.find("with which ", at);
    ASSERT_NE(mass_at, std::string::npos) << text;
    loop.damping_Ns_per_m = std::stod(text.substr(at + 10));
    EXPECT_NO_THROW(require_stable_mass(std::stod(text.substr(mass_at + 11)), hand, loop, false));
    loop.damping_Ns_per_m *= 0.4;  // less than the one before in the series 1, 2, 5, 10
    EXPECT_FALSE(smallest_stable_mass(hand, loop).has_value());
  }
}

}  // namespace
}  // namespace proxarm::controller
