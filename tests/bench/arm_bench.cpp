// What the arm costs in a cycle: kinematics, its inverse, statics.
#include <benchmark/benchmark.h>

#include "models/arm/inverse_kinematics.hpp"
#include "tests/source_file.hpp"

namespace {

using namespace proxarm;
using models::JointVector;

const models::Arm& arm() {
  static const models::Arm instance(description::load_cell(source_file("models/cells/default.yaml")));
  return instance;
}

void kinematics_and_jacobian(benchmark::State& state) {
  JointVector q = arm().start_rad();
  models::ToolKinematics at_q;
  for (auto _ : state) {
    q[0] += 1e-6;
    arm().kinematics(q, at_q);
    benchmark::DoNotOptimize(at_q);
  }
}
BENCHMARK(kinematics_and_jacobian);

void gravity_torque(benchmark::State& state) {
  JointVector q = arm().start_rad();
  for (auto _ : state) {
    q[0] += 1e-6;
    benchmark::DoNotOptimize(arm().gravity_torque(q));
  }
}
BENCHMARK(gravity_torque);

void motor_from_link(benchmark::State& state) {
  JointVector q = arm().start_rad();
  for (auto _ : state) {
    q[0] += 1e-6;
    benchmark::DoNotOptimize(arm().motor_from_link(q));
  }
}
BENCHMARK(motor_from_link);

void link_from_motor(benchmark::State& state) {
  JointVector q = arm().start_rad();
  for (auto _ : state) {
    q[0] += 1e-6;
    benchmark::DoNotOptimize(arm().link_from_motor(q));
  }
}
BENCHMARK(link_from_motor);

void mass_matrix(benchmark::State& state) {
  JointVector q = arm().start_rad();
  for (auto _ : state) {
    q[0] += 1e-6;
    benchmark::DoNotOptimize(arm().mass_matrix(q));
  }
}
BENCHMARK(mass_matrix);

// The tool follows a line of 0.2 m at a speed in mm per cycle (1 kHz: m/s).
void inverse_kinematics(benchmark::State& state) {
  const models::InverseKinematics inverse(arm());
  const models::Pose X_start = arm().tool_pose(arm().start_rad());
  const double step_m = 1e-6 * static_cast<double>(state.range(0));
  models::InverseKinematicsResult result;
  JointVector q = arm().start_rad();
  std::int64_t cycle = 0, steps = 0, cycles = 0;
  for (auto _ : state) {
    models::Pose X = X_start;
    X.translation().x() += step_m * static_cast<double>(++cycle);
    inverse.solve(q, X, result);
    q = result.q;
    steps += result.iterations;
    ++cycles;
    if (step_m * static_cast<double>(cycle) > 0.2) {
      q = arm().start_rad();
      cycle = 0;
    }
  }
  state.counters["newton_steps"] = static_cast<double>(steps) / static_cast<double>(cycles);
}
BENCHMARK(inverse_kinematics)->Arg(1)->Arg(50)->Arg(500);

// The wrist stretched and a turn wanted that it can't make: damped steps, the dearest case.
void inverse_kinematics_at_singularity(benchmark::State& state) {
  const models::InverseKinematics inverse(arm());
  JointVector q(6);
  q << 0.3, 0.2, 0.4, 0.5, 0.0, -0.2;
  models::Pose X = arm().tool_pose(q);
  X.linear() = Eigen::AngleAxisd(0.02, models::Vec3(0.6, 0.0, 0.8)).toRotationMatrix() * X.linear();
  models::InverseKinematicsResult result;
  for (auto _ : state) {
    inverse.solve(q, X, result);
    benchmark::DoNotOptimize(result);
  }
}
BENCHMARK(inverse_kinematics_at_singularity);

}  // namespace
