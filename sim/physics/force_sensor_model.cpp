#include "sim/physics/force_sensor_model.hpp"

#include <algorithm>
#include <cmath>

#include "models/base/setup_error.hpp"
#include "models/geometry/linear_systems.hpp"
#include "sim/physics/noise.hpp"

namespace proxarm::sim {
namespace {

using description::SetupError;
using Vec6 = models::Vec<6>;

Vec6 stacked(const models::Wrench& wrench) {
  Vec6 w;
  w << wrench.force, wrench.torque;
  return w;
}

}  // namespace

ForceSensorModel::ForceSensorModel(const description::SensorPlacement& placement,
                                   const description::SensorSimulation& simulation, std::uint64_t seed)
    : rate_Hz_(placement.sample_rate_Hz),
      time_constant_s_(placement.bandwidth_Hz > 0.0 ? 1.0 / (2.0 * M_PI * placement.bandwidth_Hz) : 0.0),
      seed_(mixed(seed)) {
  if (!(rate_Hz_ > 0.0)) {
    throw SetupError({.key = "sensor.sample_rate_Hz",
                      .found = description::number_text(rate_Hz_),
                      .expected = "above 0 for the simulated sensor"});
  }
  if (simulation.counts_per_N == 0 || simulation.counts_per_Nm == 0)
    throw SetupError({.key = "simulation.counts_per_N, counts_per_Nm", .found = "0", .expected = "at least 1"});
  models::Mat6 matrix;
  for (int row = 0; row < 6; ++row)
    for (int column = 0; column < 6; ++column)
      matrix(row, column) = simulation.matrix[static_cast<std::size_t>(row)][static_cast<std::size_t>(column)];
  const std::optional<models::Mat6> inverse = models::inverse_if_regular(matrix);
  if (!inverse) throw SetupError({.key = "simulation.matrix", .message = "the calibration matrix can't be inverted"});
  const auto counts_N = static_cast<double>(simulation.counts_per_N);
  const auto counts_Nm = static_cast<double>(simulation.counts_per_Nm);
  Vec6 counts_per_unit;
  counts_per_unit << counts_N, counts_N, counts_N, counts_Nm, counts_Nm, counts_Nm;
  gauges_per_unit_ = *inverse * counts_per_unit.asDiagonal();
  bias_counts_ = Vec6(simulation.bias_counts.data());
  const double n = placement.noise_N, m = placement.noise_Nm;
  noise_deviation_ << n, n, n, m, m, m;
}

void ForceSensorModel::reset(std::int64_t time_ns, const models::Wrench& wrench_S) noexcept {
  now_ = {.start_ns = time_ns, .start = stacked(wrench_S), .input = stacked(wrench_S)};
  before_ = now_;
}

void ForceSensorModel::set_wrench(std::int64_t time_ns, const models::Wrench& wrench_S) noexcept {
  if (time_ns - now_.start_ns != step_ns_) {
    step_ns_ = time_ns - now_.start_ns;
    step_decay_ = decay(step_ns_);
  }
  before_ = now_;
  now_.start_ns = time_ns;
  now_.start = before_.input + step_decay_ * (before_.start - before_.input);
  now_.input = stacked(wrench_S);
}

double ForceSensorModel::decay(std::int64_t elapsed_ns) const noexcept {
  return time_constant_s_ > 0.0 ? std::exp(-1e-9 * static_cast<double>(elapsed_ns) / time_constant_s_) : 0.0;
}

// Returns the output of the low-pass at time t, with input w, start value y(t₀) and time constant τ:
//   y(t) = w + (y(t₀) − w) e^(−(t − t₀)/τ)
Vec6 ForceSensorModel::filtered(const Piece& piece, std::int64_t time_ns) const noexcept {
  return piece.input + decay(std::max<std::int64_t>(0, time_ns - piece.start_ns)) * (piece.start - piece.input);
}

ForceSensorModel::Instant ForceSensorModel::latest_instant(std::int64_t time_ns) const noexcept {
  const auto instant = [&](std::int64_t number) {
    return static_cast<std::int64_t>(1e9 * (static_cast<double>(number) / rate_Hz_));
  };
  Instant latest;
  latest.number = static_cast<std::int64_t>(1e-9 * static_cast<double>(time_ns) * rate_Hz_);
  if (instant(latest.number) > time_ns) --latest.number;
  if (instant(latest.number + 1) <= time_ns) ++latest.number;
  latest.time_ns = instant(latest.number);
  return latest;
}

void ForceSensorModel::lie(Vec6& wrench, std::int64_t time_ns) const noexcept {
  if (lies_.turned) {
    for (const int i : {0, 1, 3, 4}) wrench[i] = -wrench[i];
  }
  wrench *= lies_.inverted ? -lies_.scale : lies_.scale;
  const auto drifts_ns = static_cast<double>(std::max<std::int64_t>(0, time_ns - lies_.drifts_from_ns));
  wrench[0] += lies_.offset_N + 1e-9 * drifts_ns * lies_.drift_N_per_s;
}

Vec6 ForceSensorModel::noisy_wrench(const Instant& instant) const noexcept {
  Vec6 wrench = filtered(instant.time_ns >= now_.start_ns ? now_ : before_, instant.time_ns);
  lie(wrench, instant.time_ns);
  const std::uint64_t key = seed_ + 32 * static_cast<std::uint64_t>(instant.number);
  for (int i = 0; i < 6; ++i) wrench[i] += noise_deviation_[i] * normal(key + 4 * static_cast<std::uint64_t>(i));
  return wrench;
}

std::array<double, 6> ForceSensorModel::wrench(std::int64_t time_ns) const noexcept {
  const Vec6 w = noisy_wrench(latest_instant(time_ns));
  return {w[0], w[1], w[2], w[3], w[4], w[5]};
}

GaugeSample ForceSensorModel::sample(std::int64_t time_ns) const noexcept {
  GaugeSample result;
  const Instant instant = latest_instant(time_ns);
  result.number = instant.number;
  result.time_ns = instant.time_ns;
  const Vec6 wrench = noisy_wrench(instant);
  const Vec6 counts = gauges_per_unit_ * wrench + bias_counts_;
  for (int i = 0; i < 6; ++i) {
    const double limited = std::clamp(std::nearbyint(counts[i]), -32768.0, 32767.0);
    result.gauges[static_cast<std::size_t>(i)] = static_cast<std::int16_t>(limited);
    result.saturated = result.saturated || limited <= -32768.0 || limited >= 32767.0;
  }
  return result;
}

}  // namespace proxarm::sim
