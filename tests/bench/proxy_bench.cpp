// What a step of the proxy, its record and the stability check cost.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <random>
#include <vector>

#include "controller/limits/limited_algorithm.hpp"
#include "controller/proxies/admittance_proxy.hpp"
#include "controller/record/cycle_record.hpp"
#include "controller/report/session_record.hpp"
#include "controller/report/summary.hpp"
#include "controller/stability/passivity.hpp"
#include "controller/stability/stability.hpp"
#include "models/base/spsc_ring.hpp"
#include "models/obstacles/round_obstacle.hpp"
#include "models/surfaces/free_space.hpp"
#include "models/surfaces/friction_plane.hpp"
#include "models/world/world.hpp"

namespace {

using namespace proxarm;
using models::Vec3;

// Pushed to and fro; the force is as large as it is on the default scene's wall.
Vec3 push(int k) { return {10.0, k % 200 < 100 ? 6.0 : -6.0, 0.0}; }

void run(benchmark::State& state, models::GeometricAlgorithm<3>& world) {
  controller::AdmittanceProxy<3> proxy({.mass_kg = 4.0, .order = static_cast<int>(state.range(0))}, world);
  proxy.start({.q = Vec3(0.9, 0.0, 0.6), .v = Vec3::Zero(), .a = Vec3::Zero()});
  int k = 0;
  for (auto _ : state) benchmark::DoNotOptimize(proxy.step(push(++k)));
}

// What there is to be had: (26a) alone, in a loop.
void bare_step(benchmark::State& state) {
  Vec3 q(0.9, 0.0, 0.6), v = Vec3::Zero();
  const double T = 1e-3, M = 4.0;
  int k = 0;
  for (auto _ : state) {
    v += T / M * push(++k);
    q += T * v;
    benchmark::DoNotOptimize(q);
  }
}
BENCHMARK(bare_step);

void proxy_step_free(benchmark::State& state) {
  models::FreeSpace<3> world;
  run(state, world);
}
BENCHMARK(proxy_step_free)->Arg(1)->Arg(2);

void proxy_step_wall(benchmark::State& state) {
  models::FrictionPlane<3> world(Vec3(0.9, 0.0, 0.6), Vec3(-1.0, 0.0, 0.0), 0.3);
  run(state, world);
}
BENCHMARK(proxy_step_wall)->Arg(1)->Arg(2);

void proxy_step_globe(benchmark::State& state) {
  std::vector<models::World::Entry> entries;
  entries.push_back({std::make_unique<models::Sphere>(models::PointCore{Vec3(0.8, 0.0, 0.6)}, 0.1, 0.0, true), 0, 0});
  models::World world(std::move(entries));
  run(state, world);
}
BENCHMARK(proxy_step_globe)->Arg(1)->Arg(2);

// A step at a wall that limits touch, as in limits_test.cpp; the argument is the friction in percent.
void limited_step(benchmark::State& state) {
  std::mt19937 engine(1);
  const auto uniform = [&](double low, double high) { return std::uniform_real_distribution(low, high)(engine); };
  const auto in_box = [&](double half) {
    return Vec3(uniform(-half, half), uniform(-half, half), uniform(-half, half));
  };
  struct Step {
    controller::StepLimits limits;
    Vec3 p, q;
  };
  models::FrictionPlane<3> wall(Vec3::Zero(), Vec3::UnitX(), 0.01 * static_cast<double>(state.range(0)));
  controller::LimitedAlgorithm<3> limited(wall);
  std::vector<Step> steps;
  while (steps.size() < 1024) {
    Step step{{}, Vec3::Zero(), in_box(1e-4)};
    step.q.x() = std::max(0.0, step.q.x());
    step.p = step.q + in_box(4e-4);
    step.limits.hard[step.limits.hard_count++] = {Vec3::Zero(), uniform(1e-5, 3e-4), controller::Limit::speed};
    step.limits.hard[step.limits.hard_count++] = {in_box(1e-5), uniform(5e-5, 3e-4), controller::Limit::acceleration};
    for (auto planes = engine() % 4; planes > 0; --planes) {
      step.limits.planes[step.limits.plane_count++] = {in_box(1.0).normalized(), uniform(0.0, 2e-4),
                                                       controller::Limit::joint_speed, 1};
    }
    limited.set_limits(step.limits, Eigen::Matrix3d::Identity(), step.q);
    limited(1e6, step.p, step.q);
    if (limited.active().kinds != 0) steps.push_back(step);
  }
  std::size_t i = 0;
  for (auto _ : state) {
    const Step& step = steps[++i % steps.size()];
    limited.set_limits(step.limits, Eigen::Matrix3d::Identity(), step.q);
    benchmark::DoNotOptimize(limited(1e6, step.p, step.q));
  }
}
BENCHMARK(limited_step)->Arg(0)->Arg(30);

// What --passivity costs a cycle.
void passivity_step(benchmark::State& state) {
  controller::PassivityObserver observer({}, 1e-3, controller::Damping::what_lasts);
  observer.start(Vec3::Zero());
  Vec3 tool_W = Vec3::Zero(), v_W(0.0, 0.1, 0.0);
  int k = 0;
  for (auto _ : state) {
    if (++k % 100 == 0) v_W = -v_W;
    tool_W += 1e-3 * v_W;
    benchmark::DoNotOptimize(observer.observe_hand(Vec3(10.0, 6.0, 0.0), tool_W));
    observer.observe_proxy(v_W, Vec3(-10.0, 0.0, 0.0), 4.0, 0.0);
  }
}
BENCHMARK(passivity_step);

void ring_push_and_pop(benchmark::State& state) {
  controller::SpscRing<controller::CycleRecord> ring(1024);
  controller::CycleRecord record;
  for (auto _ : state) {
    ring.push(record);
    ring.pop(record);
    benchmark::DoNotOptimize(record);
  }
}
BENCHMARK(ring_push_and_pop);

void summary_per_record(benchmark::State& state) {
  controller::SummaryBuilder builder({});
  controller::CycleRecord record;
  record.phase = controller::Phase::rendering;
  record.axes = 6;
  record.set(controller::RecordFlag::truth);
  for (auto _ : state) {
    ++record.cycle;
    record.true_tool_W_m[0] += 1e-5;
    builder.add(record);
  }
}
BENCHMARK(summary_per_record);

void signals_row(benchmark::State& state) {
  controller::CycleRecord record;
  record.set(controller::RecordFlag::truth);
  record.proxy_W_m = record.tool_W_m = record.p_hat_W_m =
      record.true_tool_W_m = {0.123456789012345, 1.0 / 3.0, 2.0 / 7.0};
  record.force_S_N = record.force_W_N = record.hand_force_W_N =
      record.contact_force_W_N = {1.0 / 7.0, 2.0 / 3.0, 9.0 / 7.0};
  std::string row;
  for (auto _ : state) {
    row.clear();
    controller::append_signals(row, record, 6, true);
    benchmark::DoNotOptimize(row.data());
  }
}
BENCHMARK(signals_row);

void stability_check(benchmark::State& state) {
  const controller::LoopModel loop{.delay_s = 2e-3, .drive_time_constant_s = 1.6e-3, .handle_mass_kg = 0.25};
  for (auto _ : state) benchmark::DoNotOptimize(controller::smallest_stable_mass({}, loop));
}
BENCHMARK(stability_check)->Unit(benchmark::kMicrosecond);

}  // namespace
