// Ways of a rigid tool that a hand drives, recorded once and played again, so that only steps are timed, and the same
// ones each time.
#pragma once

#include <algorithm>
#include <array>
#include <chrono>
#include <utility>
#include <vector>

#include "models/base/random.hpp"
#include "models/rigid/rigid_world.hpp"
#include "tests/models/rigid_judges/held_tool.hpp"

namespace proxarm::bench {

using models::HeldTool;
using models::Random;
using models::RigidWorld;
using models::RoamingHand;
using models::ToolPose;

struct Run {
  struct Step {
    ToolPose p_hat, q;
    std::size_t contacts = 0;
    bool unresolved = false;
  };
  RigidWorld start;
  models::Mat6 K;
  std::vector<Step> steps;

  [[nodiscard]] RigidWorld& begin(std::vector<RigidWorld>& room) const {
    room.assign(1, start);
    return room.front();
  }
};

inline Run record(const RigidWorld& world, HeldTool held, RoamingHand hand, std::uint64_t seed, int steps) {
  Run run{world, held.K, {}};
  RigidWorld g = world;
  Random random(seed);
  for (int k = 0; k < steps; ++k) {
    const ToolPose p = held.freely(hand.wrench(random, held, k)), q = held.q;
    held.arrive(g.step(held.K, p, q));
    run.steps.push_back({p, q, g.contacts().size(), g.unresolved()});
  }
  return run;
}

// What single steps take, in µs, less what reading the clock does: of each the least of three times that the same
// steps are played, for others use the machine as well.
inline std::vector<double> time_steps(const Run& run) {
  using Clock = std::chrono::steady_clock;
  const auto us = [](Clock::duration d) { return std::chrono::duration<double, std::micro>(d).count(); };
  std::vector<double> least(run.steps.size(), 1e300), empty;
  std::vector<RigidWorld> room;
  for (int round = 0; round < 3; ++round) {
    RigidWorld& g = run.begin(room);
    for (std::size_t k = 0; k < run.steps.size(); ++k) {
      const auto begun = Clock::now();
      const auto clock = Clock::now();
      g.step(run.K, run.steps[k].p_hat, run.steps[k].q);
      const auto ended = Clock::now();
      empty.push_back(us(clock - begun));
      least[k] = std::min(least[k], us(ended - clock));
    }
  }
  std::nth_element(empty.begin(), empty.begin() + static_cast<std::ptrdiff_t>(empty.size() / 2), empty.end());
  for (double& time : least) time = std::max(time - empty[empty.size() / 2], 0.0);
  return least;
}

}  // namespace proxarm::bench
