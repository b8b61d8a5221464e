// The measuring part of a simulated force sensor: converts the true wrench into strain gauge counts, at the converter's
// rate.
//
//   wrench → low-pass of order 1 → at the converter's next sample time: + noise
//   gauges = matrix⁻¹ · (counts per unit · wrench) + bias, rounded and saturated to int16
//
// The converter runs independently of its readers. Its sample times are k/rate from time zero on, rounded down to ns. A
// reader gets the latest finished sample. Noise depends only on the seed and the number of the sample, not on the time
// of reading.
#pragma once

#include <array>
#include <cstdint>

#include "models/description/cell.hpp"
#include "models/description/sensor.hpp"
#include "models/geometry/geometry.hpp"

namespace proxarm::sim {

struct GaugeSample {
  std::array<std::int16_t, 6> gauges{};
  bool saturated = false;    // true: some gauge is at the end of its range
  std::int64_t number = 0;   // counted from time zero
  std::int64_t time_ns = 0;  // sample time
};

// Errors of a sensor that the sensor's messages don't reveal.
struct SensorLies {
  double scale = 1.0;          // factor on the whole wrench
  bool inverted = false;       // all readings have the wrong sign
  bool turned = false;         // all readings are turned by 180° about z
  double offset_N = 0.0;       // along x
  double drift_N_per_s = 0.0;  // along x, starting at drifts_from_ns
  std::int64_t drifts_from_ns = 0;
};

class ForceSensorModel {
 public:
  // Throws description::SetupError if the matrix is singular, or if the rate or the counts per unit are zero.
  ForceSensorModel(const description::SensorPlacement& placement, const description::SensorSimulation& simulation,
                   std::uint64_t seed = 1);

  // Restarts the model at time_ns with the low-pass settled at this wrench.
  void reset(std::int64_t time_ns, const models::Wrench& wrench_S) noexcept;
  // Sets the wrench that acts from time_ns until the next call. Precondition: times increase from call to call.
  void set_wrench(std::int64_t time_ns, const models::Wrench& wrench_S) noexcept;
  [[nodiscard]] SensorLies& lies() noexcept { return lies_; }
  // Returns the latest finished sample at time_ns. Precondition: time_ns isn't before the second-last call of
  // set_wrench().
  [[nodiscard]] GaugeSample sample(std::int64_t time_ns) const noexcept;
  // Returns the wrench of the latest finished sample before its conversion to gauges, noise included: fx fy fz (N), tx
  // ty tz (Nm).
  [[nodiscard]] std::array<double, 6> wrench(std::int64_t time_ns) const noexcept;

 private:
  using Vec6 = models::Vec<6>;
  struct Piece {  // from start_ns on, the output of the low-pass goes from `start` towards `input`
    std::int64_t start_ns = 0;
    Vec6 start = Vec6::Zero(), input = Vec6::Zero();
  };
  [[nodiscard]] double decay(std::int64_t elapsed_ns) const noexcept;
  struct Instant {
    std::int64_t number = 0, time_ns = 0;
  };
  [[nodiscard]] Instant latest_instant(std::int64_t time_ns) const noexcept;
  void lie(Vec6& wrench, std::int64_t time_ns) const noexcept;
  [[nodiscard]] Vec6 noisy_wrench(const Instant& instant) const noexcept;
  [[nodiscard]] Vec6 filtered(const Piece& piece, std::int64_t time_ns) const noexcept;

  Eigen::Matrix<double, 6, 6> gauges_per_unit_;  // matrix⁻¹ · counts per unit
  Vec6 bias_counts_, noise_deviation_;
  double rate_Hz_, time_constant_s_;
  std::uint64_t seed_;
  // Length of the last step. step_decay_ is its decay; it is kept because steps have equal length.
  std::int64_t step_ns_ = 0;
  double step_decay_ = 1.0;
  Piece before_, now_;
  SensorLies lies_;
};

}  // namespace proxarm::sim
