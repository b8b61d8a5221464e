// The inside of a simulated force sensor: true wrench in, strain gauge counts out, at the converter's own rate.
//
//   low-pass of order 1 → at the converter's next instant: + noise → gauges = matrix⁻¹ · (counts per unit · wrench) +
//   bias → rounded, saturated to int16
// The converter runs by itself (its instants are k/rate, rounded down to nanoseconds, from time zero) and latches: who
// asks gets the latest finished sample. Noise depends on seed and sample number only, not on when somebody asks.
#pragma once

#include <array>
#include <cstdint>

#include "models/description/cell.hpp"
#include "models/description/sensor.hpp"
#include "models/geometry/geometry.hpp"

namespace proxarm::sim {

struct GaugeSample {
  std::array<std::int16_t, 6> gauges{};
  bool saturated = false;    // some gauge is at its end
  std::int64_t number = 0;   // of the sample, counted from time zero
  std::int64_t time_ns = 0;  // of the converter's instant
};

// What a sensor may say that isn't so, and nobody can tell from its words.
struct SensorLies {
  double scale = 1.0;          // of the whole wrench
  bool inverted = false;       // with the wrong sign
  bool turned = false;         // by half a turn about z
  double offset_N = 0.0;       // along x
  double drift_N_per_s = 0.0;  // along x, from that time on
  std::int64_t drifts_from_ns = 0;
};

class ForceSensorModel {
 public:
  // Throws description::SetupError on a singular matrix, or a rate or counts per unit of zero.
  ForceSensorModel(const description::SensorPlacement& placement, const description::SensorSimulation& simulation,
                   std::uint64_t seed = 1);

  // Settles the low-pass at this wrench.
  void reset(std::int64_t time_ns, const models::Wrench& wrench_S) noexcept;
  // The wrench from now on until the next call; times rise.
  void set_wrench(std::int64_t time_ns, const models::Wrench& wrench_S) noexcept;
  [[nodiscard]] SensorLies& lies() noexcept { return lies_; }
  // The latest sample at this time: not before the last but one set_wrench().
  [[nodiscard]] GaugeSample sample(std::int64_t time_ns) const noexcept;
  // What went into that sample, noise included, before any gauge: fx fy fz (N), tx ty tz (Nm).
  [[nodiscard]] std::array<double, 6> wrench(std::int64_t time_ns) const noexcept;

 private:
  using Vec6 = models::Vec<6>;
  struct Piece {  // from start_ns on: the low-pass at `start` goes towards `input`
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
  std::int64_t step_ns_ = 0;  // steps are equal: the decay over one is kept
  double step_decay_ = 1.0;
  Piece before_, now_;
  SensorLies lies_;
};

}  // namespace proxarm::sim
