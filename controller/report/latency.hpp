// Measures from the black box's entries how late cycles are and how long they take, in real time. Not for the cycle.
//
//   wake_up             from t_k until SYNC is handed to the first interface with drives
//   compute             the duration of the cycle, without waiting
//   sensor_to_setpoint  from the sensor's last frame on the wire until the last setpoint is handed to its interface.
//                       Only cycles with a new sample of the sensor count
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "controller/record/black_box.hpp"
#include "controller/report/summary.hpp"

namespace proxarm::controller {

// Bins of 1 µs up to 4096 µs, then bins of a sixteenth of an octave up to an hour.
class LatencyHistogram {
 public:
  static constexpr std::size_t fine = 4096, per_octave = 16, octaves = 20, bins = fine + per_octave * octaves;

  void add(std::int64_t time_ns) noexcept {
    const std::int64_t us = std::max<std::int64_t>(time_ns, 0) / 1000;
    ++counts_[bin_of(static_cast<std::uint64_t>(us))];
    ++count_;
    max_ns_ = std::max(max_ns_, time_ns);
  }

  [[nodiscard]] std::uint64_t count() const noexcept { return count_; }
  [[nodiscard]] double max_us() const noexcept { return 1e-3 * static_cast<double>(max_ns_); }
  // Returns the quantile of `share`, µs, rounded up to the end of its bin. In the last bin, returns the largest time.
  [[nodiscard]] double quantile_us(double share) const noexcept {
    std::uint64_t below = 0;
    for (std::size_t bin = 0; bin + 1 < bins; ++bin) {
      below += counts_[bin];
      if (static_cast<double>(below) >= share * static_cast<double>(count_)) {
        return std::min(static_cast<double>(begin_us(bin + 1)), max_us());
      }
    }
    return max_us();
  }
  [[nodiscard]] const std::array<std::uint64_t, bins>& counts() const noexcept { return counts_; }
  // Returns the lower edge of this bin, µs.
  [[nodiscard]] static constexpr std::uint64_t begin_us(std::size_t bin) noexcept {
    if (bin < fine) return bin;
    const std::size_t octave = (bin - fine) / per_octave, part = (bin - fine) % per_octave;
    return static_cast<std::uint64_t>(per_octave + part) * (fine / per_octave) << octave;
  }

 private:
  static constexpr std::size_t bin_of(std::uint64_t us) noexcept {
    if (us < fine) return static_cast<std::size_t>(us);
    const auto octave = static_cast<std::size_t>(std::bit_width(us / fine)) - 1;
    const auto part = static_cast<std::size_t>(us >> octave) * per_octave / fine - per_octave;
    return std::min(fine + per_octave * octave + part, bins - 1);
  }

  std::array<std::uint64_t, bins> counts_{};
  std::uint64_t count_ = 0;
  std::int64_t max_ns_ = 0;
};

[[nodiscard]] LatencySummary latency_summary(const LatencyHistogram& times);

struct Latencies {
  LatencyHistogram wake_up, compute, sensor_to_setpoint;
};

class LatencyMeter {
 public:
  // `sensor_ids`: identifiers of the sensor's frames; 29-bit identifiers have fieldbus::extended_id_flag. Precondition:
  // `box` outlives this object.
  LatencyMeter(const BlackBox& box, std::size_t sensor_bus, std::vector<std::uint32_t> sensor_ids)
      : box_(box), sensor_bus_(sensor_bus), sensor_ids_(std::move(sensor_ids)) {}

  // Takes all whole cycles since the last call, except cycles that the box has overwritten.
  void drain();
  [[nodiscard]] const Latencies& latencies() const noexcept { return latencies_; }

 private:
  void add(const BoxCycle& cycle, const std::vector<BoxFrame>& frames);

  const BlackBox& box_;
  std::size_t sensor_bus_;
  std::vector<std::uint32_t> sensor_ids_;
  std::uint64_t next_ = 0;
  Latencies latencies_;
};

}  // namespace proxarm::controller
