// Keeps the faults of a session that were reset: the latest eight, and the number of all.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "controller/supervision/fault.hpp"

namespace proxarm::controller {

class PastFaults {
 public:
  void add(const FaultReport& report) noexcept {
    if (count_ >= kept_.size()) std::rotate(kept_.begin(), kept_.begin() + 1, kept_.end());
    kept_[std::min<std::size_t>(count_, kept_.size() - 1)] = report;
    ++count_;
  }
  // The latest eight faults, oldest first.
  [[nodiscard]] std::span<const FaultReport> latest() const noexcept {
    return std::span(kept_).first(std::min<std::size_t>(count_, kept_.size()));
  }
  // The number of all faults that were added.
  [[nodiscard]] std::uint64_t count() const noexcept { return count_; }

 private:
  std::array<FaultReport, 8> kept_{};
  std::uint64_t count_ = 0;
};

}  // namespace proxarm::controller
