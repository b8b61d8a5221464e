// (26) for a rigid tool beside MuJoCo and Bullet (in double precision): a box on a table, and a peg of 20 mm g6 in a
// hole H7, led by the same hand at 1 kHz. The time of a step, and how far the tool is in the objects and off them where
// the hand presses it on: by formulas of this file's, from its poses.
//
// Each engine is at its best: of the settings below, the one that errs least, as the rms gap where it is 0 by right.
// The label says which. A hole is to them as many planes as the setting says, tangents of its circle: of the round
// shapes that they have, a cylinder on planes is the one whose contacts are in closed form.
//   MuJoCo   the contact's stiffness and damping (solref), its impedance (solimp); Newton, elliptic cones
//   Bullet   error reduction (ERP) of the contact, with split impulse and without; 50 or 500 iterations; how far apart
//   contacts
//            are forgotten
#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <numbers>

#include "tests/bench/rigid_engines.hpp"

namespace proxarm::bench {
namespace {

using models::FlatSide;
using models::Random;
using models::RoamingHand;
using Gap = std::function<double(const ToolPose&)>;  // signed
using Make = std::function<std::unique_ptr<RigidEngine>()>;

constexpr double kHole = 0.01000525, kPeg = 0.00999325, kLength = 0.04;
constexpr int kSettled = 100;  // steps from a new place on, after which the tool has come to what it is pressed on

struct Case {
  std::function<RigidScene(int)> scene;  // with so many planes
  RoamingHand hand;
  Gap gap;
};

double over_table(const ToolPose& q, const Vec3& size) {
  const Vec3 n = q.orientation.conjugate() * Vec3::UnitZ();
  return q.position.z() - 0.5 * n.cwiseAbs().dot(size);
}

// The furthest that a rim comes from the z axis: 64 places around, and thirds about the furthest of them.
double furthest(const Vec3& centre, const Vec3& u, const Vec3& v) {
  constexpr int kPlaces = 64;
  constexpr double kStep = 2.0 * std::numbers::pi / kPlaces;
  const auto at = [&](double angle) {
    return (centre + kPeg * (std::cos(angle) * u + std::sin(angle) * v)).head<2>().norm();
  };
  double low = 0.0, most = 0.0;
  for (int k = 0; k < kPlaces; ++k) {
    if (const double here = at(k * kStep); here > most) {
      most = here;
      low = (k - 1) * kStep;
    }
  }
  double high = low + 2.0 * kStep;
  for (int k = 0; k < 40; ++k) {
    const double x = low + (high - low) / 3.0, y = high - (high - low) / 3.0;
    (at(x) < at(y) ? low : high) = at(x) < at(y) ? x : y;
  }
  return std::max(most, at(0.5 * (low + high)));
}

double in_hole(const ToolPose& q) {
  const models::Mat3 R = q.orientation.toRotationMatrix();
  double room = kHole;
  for (const double z : {-0.5 * kLength, 0.5 * kLength}) {
    room = std::min(room, kHole - furthest(q * Vec3(0.0, 0.0, z), R.col(0), R.col(1)));
  }
  return room;
}

// Pressed onto the table by 3 to 9 N, pushed about on it, turned, and tipped at times.
Case box_on_table() {
  RigidScene scene;
  scene.size = Vec3(0.06, 0.04, 0.03);
  scene.friction = 0.3;
  scene.planes = {FlatSide{Vec3::UnitZ(), 0.0}};
  scene.ours.shape = scene.planes[0];
  scene.ours.friction = scene.friction;
  scene.start.position.z() = 0.0151;
  const RoamingHand hand{.next_place =
                             [](Random& random, const ToolPose&) {
                               const double x = random.uniform(-0.05, 0.05), y = random.uniform(-0.05, 0.05);
                               return Vec3(x, y, 0.015 - random.uniform(0.01, 0.03));
                             },
                         .most_Nm = 0.05};
  return {[scene](int) { return scene; }, hand, [size = scene.size](const ToolPose& q) { return over_table(q, size); }};
}

// Pressed against the hole's side by 3 to 9 N, in and out, tilted and turned.
Case peg_in_hole() {
  RigidScene scene;
  scene.length = kLength;
  scene.radius = kPeg;
  scene.friction = 0.15;
  scene.ours.shape = models::HollowTube{-Vec3::UnitZ(), Vec3::UnitZ(), kHole, true};
  scene.ours.friction = scene.friction;
  const auto with = [scene](int planes) {
    RigidScene out = scene;
    for (int k = 0; k < planes; ++k) {
      const double angle = 2.0 * std::numbers::pi * k / planes;
      out.planes.push_back({Vec3(-std::cos(angle), -std::sin(angle), 0.0), -kHole});
    }
    return out;
  };
  const RoamingHand hand{.next_place = [](Random& random, const ToolPose&) {
    const double angle = random.uniform(-3.0, 3.0), out = random.uniform(0.01, 0.03), z = random.uniform(-0.03, 0.03);
    return Vec3(out * std::cos(angle), out * std::sin(angle), z);
  }};
  return {with, hand, in_hole};
}

struct Figures {
  double rms = 0.0, deepest = 0.0, lift = 0.0;  // m, where the hand presses; deepest of all steps
  std::vector<double> us;                       // of single steps
  int unresolved = 0;
  bool lost = false;  // not where it was any more, by more than a millimetre
};

// Led by the hand as in every other engine: it goes by where the tool is.
Figures run(const Case& what, const Make& make, int steps, Figures figures) {
  using Clock = std::chrono::steady_clock;
  const auto us = [](Clock::duration d) { return std::chrono::duration<double, std::micro>(d).count(); };
  const auto engine = make();
  HeldTool tool(4.0, 0.05, 0.0, 0.0);
  RoamingHand hand = what.hand;
  Random random(1);
  std::vector<double> apart, empty;
  figures.us.resize(static_cast<std::size_t>(steps), 1e300);
  double sum = 0.0;
  for (int k = 0; k < steps; ++k) {
    engine->tell(tool);
    const Twist wrench = hand.wrench(random, tool, k);
    const auto begun = Clock::now();
    const auto clock = Clock::now();
    engine->step(wrench);
    const auto ended = Clock::now();
    empty.push_back(us(clock - begun));
    double& least = figures.us[static_cast<std::size_t>(k)];
    least = std::min(least, us(ended - clock));
    engine->tell(tool);
    const double gap = what.gap(tool.q);
    figures.lost = figures.lost || !(gap > -1e-3);
    if (figures.lost) return figures;
    figures.deepest = std::max(figures.deepest, -gap);
    if (hand.let_go || k % 250 < kSettled) continue;
    sum += gap * gap;
    apart.push_back(std::max(gap, 0.0));
  }
  std::sort(apart.begin(), apart.end());
  std::sort(empty.begin(), empty.end());
  figures.rms = std::sqrt(sum / static_cast<double>(apart.size()));
  figures.lift = apart[apart.size() * 95 / 100];
  figures.unresolved = engine->unresolved();
  for (double& time : figures.us) time = std::max(time - empty[empty.size() / 2], 0.0);
  return figures;
}

struct Tuned {
  std::string label{};
  Make make{};
};

void bench(benchmark::State& state, const Case& what, const std::vector<Tuned>& list) {
  const Tuned* best = nullptr;
  double least = 0.0;
  for (const Tuned& tuned : list) {
    const Figures figures = run(what, tuned.make, 2'000, {});
    if (!figures.lost && std::isfinite(figures.rms) && (best == nullptr || figures.rms < least)) {
      best = &tuned;
      least = figures.rms;
    }
  }
  if (best == nullptr) return state.SkipWithError("no setting keeps the tool where it is");
  Figures figures;
  for (auto _ : state) {
    for (int round = 0; round < 3; ++round) figures = run(what, best->make, 10'000, figures);
  }
  if (figures.lost) return state.SkipWithError("the tool isn't where it was any more");
  std::sort(figures.us.begin(), figures.us.end());
  state.counters["median_us"] = figures.us[figures.us.size() / 2];
  state.counters["p99_us"] = figures.us[figures.us.size() * 99 / 100];
  state.counters["deepest_um"] = 1e6 * figures.deepest;
  state.counters["lift_um"] = 1e6 * figures.lift;
  state.counters["rms_um"] = 1e6 * figures.rms;
  state.SetLabel(best->label + (figures.unresolved > 0 ? "; unresolved " + std::to_string(figures.unresolved) : ""));
}

std::string text(const char* pattern, double a, double b, double c) {
  char buffer[120];
  std::snprintf(buffer, sizeof buffer, pattern, a, b, c);
  return buffer;
}

std::vector<Tuned> settings_of_mujoco(const RigidScene& scene, const std::string& planes) {
  std::vector<Tuned> list;
  for (const double stiffness : {1e4, 1e5, 2.5e5, 1e6}) {
    for (const double ratio : {0.3, 1.0, 3.0}) {
      for (const double impedance : {0.9, 0.99, 0.9999}) {
        const MujocoTuning tuning{stiffness, ratio, impedance};
        list.push_back({planes + text("stiffness %g, ratio %g, impedance %g", stiffness, ratio, impedance),
                        [scene, tuning] { return std::make_unique<Mujoco>(scene, tuning); }});
      }
    }
  }
  return list;
}

std::vector<Tuned> settings_of_bullet(const RigidScene& scene, const std::string& planes) {
  std::vector<Tuned> list;
  for (const double erp : {0.2, 0.8, 1.0}) {
    for (const bool split : {false, true}) {
      for (const int iterations : {50, 500}) {
        for (const double breaking_m : {1e-4, 0.02}) {
          const BulletTuning tuning{erp, split, iterations, breaking_m};
          const char* pattern = split ? "ERP %g, split impulse, %g iterations, breaking at %g m"
                                      : "ERP %g, %g iterations, breaking at %g m";
          list.push_back({planes + text(pattern, erp, iterations, breaking_m),
                          [scene, tuning] { return std::make_unique<Bullet>(scene, tuning); }});
        }
      }
    }
  }
  return list;
}

void add(const std::string& name, const Case& what, const std::vector<int>& planes) {
  const auto add_one = [&](const char* engine, std::vector<Tuned> list) {
    benchmark::RegisterBenchmark((name + "/" + engine).c_str(),
                                 [what, list](benchmark::State& state) { bench(state, what, list); })
        ->Iterations(1)
        ->Unit(benchmark::kMillisecond);
  };
  add_one("(26)", {{"nothing to tune", [scene = what.scene(1)] { return std::make_unique<Proxy>(scene); }}});
  std::vector<Tuned> mujoco, bullet;
  for (const int count : planes) {
    const std::string said = count > 1 ? std::to_string(count) + " planes, " : "";
    for (Tuned& tuned : settings_of_mujoco(what.scene(count), said)) mujoco.push_back(std::move(tuned));
    for (Tuned& tuned : settings_of_bullet(what.scene(count), said)) bullet.push_back(std::move(tuned));
  }
  add_one("MuJoCo", std::move(mujoco));
  add_one("Bullet", std::move(bullet));
}

const int registered = [] {
  add("box_on_table", box_on_table(), {1});
  add("peg_in_hole", peg_in_hole(), {64, 128, 256});
  return 0;
}();

}  // namespace
}  // namespace proxarm::bench
