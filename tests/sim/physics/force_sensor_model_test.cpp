#include "sim/physics/force_sensor_model.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <iostream>

#include "models/base/setup_error.hpp"
#include "tests/sim/cell/default_cell.hpp"

namespace proxarm::sim {
namespace {

using models::Vec3;
using models::Wrench;
using Vec6 = models::Vec<6>;

description::SensorPlacement placement(double noise_N = 0.0, double bandwidth_Hz = 0.0) {
  description::SensorPlacement result;
  result.sample_rate_Hz = 7147.0;
  result.noise_N = noise_N;
  result.noise_Nm = 0.05 * noise_N;
  result.bandwidth_Hz = bandwidth_Hz;
  return result;
}

// What a reader of the maker's manual computes: wrench = matrix · (gauges − bias) / counts per unit.
Vec6 decoded(const description::SensorSimulation& s, const GaugeSample& sample) {
  Vec6 result = Vec6::Zero();
  for (std::size_t row = 0; row < 6; ++row) {
    for (std::size_t column = 0; column < 6; ++column)
      result[static_cast<int>(row)] += s.matrix[row][column] * (sample.gauges[column] - s.bias_counts[column]);
    result[static_cast<int>(row)] /= row < 3 ? s.counts_per_N : s.counts_per_Nm;
  }
  return result;
}

// Half a count on every gauge, through the matrix.
Vec6 resolution(const description::SensorSimulation& s) {
  Vec6 result = Vec6::Zero();
  for (std::size_t row = 0; row < 6; ++row) {
    for (const double value : s.matrix[row]) result[static_cast<int>(row)] += 0.5 * std::abs(value);
    result[static_cast<int>(row)] /= row < 3 ? s.counts_per_N : s.counts_per_Nm;
  }
  return result;
}

TEST(ForceSensorModel, GivesGaugesThatTheManualsFormulaTurnsBackIntoTheWrench) {
  const auto simulation = default_sensor().simulation;
  ForceSensorModel sensor(placement(), simulation);
  const Wrench wrench{Vec3(12.5, -40.0, 3.3), Vec3(-0.7, 1.9, 0.25)};
  sensor.reset(0, wrench);
  Vec6 expected;
  expected << wrench.force, wrench.torque;
  const Vec6 error = decoded(simulation, sensor.sample(1'000'000)) - expected;
  const Vec6 bound = resolution(simulation);
  std::cout << "resolution (half a count on all gauges): " << bound.transpose() << "\n";
  for (int i = 0; i < 6; ++i) EXPECT_LE(std::abs(error[i]), bound[i] * (1.0 + 1e-9)) << i;
}

TEST(ForceSensorModel, SaturatesAndSaysSo) {
  ForceSensorModel sensor(placement(), default_sensor().simulation);
  sensor.reset(0, {Vec3(300.0, 0.0, 0.0), Vec3::Zero()});
  EXPECT_FALSE(sensor.sample(1'000'000).saturated);
  sensor.reset(0, {Vec3(5000.0, 0.0, 0.0), Vec3::Zero()});
  const GaugeSample sample = sensor.sample(1'000'000);
  EXPECT_TRUE(sample.saturated);
  for (const auto gauge : sample.gauges) EXPECT_TRUE(gauge >= -32768 && gauge <= 32767);
}

// The converter runs by itself: a poll gets the latest finished sample, never one from the future.
TEST(ForceSensorModel, LatchesTheLatestSampleOfItsOwnClock) {
  ForceSensorModel sensor(placement(), default_sensor().simulation);
  sensor.reset(0, {});
  std::int64_t last = -1;
  for (std::int64_t t = 0; t < 2'000'000'000; t += 999'983) {
    const GaugeSample sample = sensor.sample(t);
    EXPECT_LE(sample.time_ns, t);
    EXPECT_GT(sample.time_ns, t - 139'919 - 1);  // 1/7147 s
    EXPECT_GT(sample.number, last);
    last = sample.number;
  }
  EXPECT_NEAR(static_cast<double>(last), 2.0 * 7147.0, 8.0);
}

TEST(ForceSensorModel, FiltersWithTheGivenBandwidth) {
  const auto simulation = default_sensor().simulation;
  ForceSensorModel sensor(placement(0.0, 100.0), simulation);
  sensor.reset(0, {});
  const Wrench step{Vec3(0.0, 100.0, 0.0), Vec3::Zero()};
  for (std::int64_t t = 0; t <= 5'000'000; t += 250'000) {
    sensor.set_wrench(t, step);
    const GaugeSample sample = sensor.sample(t);
    if (sample.time_ns < 0) continue;
    const double expected = 100.0 * (1.0 - std::exp(-1e-9 * static_cast<double>(sample.time_ns) * 2.0 * M_PI * 100.0));
    EXPECT_NEAR(decoded(simulation, sample)[1], expected, resolution(simulation)[1] + 1e-9) << t;
  }
}

TEST(ForceSensorModel, HasNoiseOfTheGivenSizeThatDependsOnNothingButSeedAndSample) {
  const auto simulation = default_sensor().simulation;
  ForceSensorModel sensor(placement(0.2), simulation, 7), same(placement(0.2), simulation, 7),
      other(placement(0.2), simulation, 8);
  sensor.reset(0, {});
  same.reset(0, {});
  other.reset(0, {});
  Vec6 sum = Vec6::Zero(), squares = Vec6::Zero(), products = Vec6::Zero(), last = Vec6::Zero();
  bool differs = false;
  constexpr int count = 20000;
  for (int k = 0; k < count; ++k) {
    const std::int64_t t = 1'000'000LL * (k + 1);
    const GaugeSample sample = sensor.sample(t);
    if (k % 7 == 0) {
      EXPECT_EQ(same.sample(t).gauges, sample.gauges);  // although it was asked less often
    }
    differs = differs || other.sample(t).gauges != sample.gauges;
    const Vec6 w = decoded(simulation, sample);
    sum += w;
    squares += w.cwiseProduct(w);
    products += w.cwiseProduct(last);
    last = w;
  }
  EXPECT_TRUE(differs);
  for (int i = 0; i < 6; ++i) {
    const double sigma = i < 3 ? 0.2 : 0.01;
    // 20,000 samples: deviation known to 0.5 %, mean to 0.7 % of it, correlation to 0.7 %; five times that.
    EXPECT_NEAR(std::sqrt(squares[i] / count), sigma, 0.025 * sigma + 0.05 * resolution(simulation)[i]) << i;
    EXPECT_LT(std::abs(sum[i] / count), 0.035 * sigma) << i;
    EXPECT_LT(std::abs(products[i] / squares[i]), 0.035) << i;
  }
}

TEST(ForceSensorModel, RefusesAMatrixThatCannotBeInverted) {
  auto simulation = default_sensor().simulation;
  simulation.matrix[3] = simulation.matrix[4];
  EXPECT_THROW(ForceSensorModel(placement(), simulation), description::SetupError);
  simulation = default_sensor().simulation;
  simulation.counts_per_Nm = 0;
  EXPECT_THROW(ForceSensorModel(placement(), simulation), description::SetupError);
  auto silent = placement();
  silent.sample_rate_Hz = 0.0;
  EXPECT_THROW(ForceSensorModel(silent, default_sensor().simulation), description::SetupError);
}

}  // namespace
}  // namespace proxarm::sim
