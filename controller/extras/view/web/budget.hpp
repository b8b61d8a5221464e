// A token bucket: limits events to a number per second, with a reserve for bursts.
#pragma once

#include <algorithm>
#include <chrono>

namespace proxarm::view {

class Budget {
 public:
  using Clock = std::chrono::steady_clock;
  Budget(double per_second, double most) noexcept : per_second_(per_second), most_(most), left_(most) {}

  // Takes a token. Returns false if none is left at this time.
  bool spend(Clock::time_point now = Clock::now()) noexcept {
    left_ = std::min(most_, left_ + per_second_ * std::chrono::duration<double>(now - since_).count());
    since_ = now;
    if (left_ < 1.0) return false;
    left_ -= 1.0;
    return true;
  }

 private:
  double per_second_, most_, left_;
  Clock::time_point since_ = Clock::now();
};

}  // namespace proxarm::view
