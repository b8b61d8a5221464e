// The zero of a force sensor: the mean of some raw readings, and the wrench that is known to act while they are taken.
//
//   wrench_S = matrix · (reading − bias) + known wrench
//
// Raw readings are whatever the sensor's matrix takes: counts of gauges (whole numbers; sums of those are exact), or
// newtons. noexcept, no allocation.
#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "fieldbus/force_sensor.hpp"

namespace proxarm::fieldbus {

template <std::size_t Channels>
class SensorTare {
 public:
  // The mean of the next `samples` readings becomes the bias; until then the one before stays.
  void begin(std::size_t samples, const Wrench& known_wrench_S) noexcept {
    wanted_ = samples;
    taken_ = 0;
    sum_ = {};
    next_known_S_ = known_wrench_S;
  }
  [[nodiscard]] bool running() const noexcept { return wanted_ > 0; }

  // A healthy reading, at most `Channels` numbers.
  template <typename Number>
  void add(std::span<const Number> reading) noexcept {
    if (!running()) return;
    for (std::size_t i = 0; i < reading.size(); ++i) sum_[i] += static_cast<double>(reading[i]);
    if (++taken_ < wanted_) return;
    for (std::size_t i = 0; i < reading.size(); ++i) bias_[i] = sum_[i] / static_cast<double>(taken_);
    known_S_ = next_known_S_;
    wanted_ = 0;
  }

  [[nodiscard]] const std::array<double, Channels>& bias() const noexcept { return bias_; }
  [[nodiscard]] const Wrench& known_wrench_S() const noexcept { return known_S_; }

  void archive(StateArchive& state) noexcept { state(bias_, known_S_, wanted_, taken_, sum_, next_known_S_); }

 private:
  std::array<double, Channels> bias_{};
  Wrench known_S_{};
  std::size_t wanted_ = 0;  // readings that the running tare takes in all; 0: none runs
  std::size_t taken_ = 0;
  std::array<double, Channels> sum_{};
  Wrench next_known_S_{};
};

}  // namespace proxarm::fieldbus
