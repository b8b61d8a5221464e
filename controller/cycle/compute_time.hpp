// Measures the computing time since construction, without the time spent waiting for frames.
#pragma once

#include <chrono>
#include <cstdint>

#include "fieldbus/can/can_network.hpp"

namespace proxarm::controller {

class ComputeTime {
 public:
  explicit ComputeTime(const fieldbus::CanNetwork& network) noexcept
      : network_(network), waited_before_ns_(network.waited_ns()), begun_(std::chrono::steady_clock::now()) {}

  [[nodiscard]] std::int64_t ns() const noexcept {
    const std::chrono::nanoseconds passed = std::chrono::steady_clock::now() - begun_;
    return passed.count() - (network_.waited_ns() - waited_before_ns_);
  }

 private:
  const fieldbus::CanNetwork& network_;
  std::int64_t waited_before_ns_;
  std::chrono::steady_clock::time_point begun_;
};

}  // namespace proxarm::controller
