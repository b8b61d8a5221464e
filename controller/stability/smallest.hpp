// The smallest of some quantity that holds.
#pragma once

#include <cmath>
#include <optional>

namespace proxarm::controller {

// Tried from the largest down until one doesn't hold, not below `least`; the last step is then bisected to a share of
// `close_enough`. None: the largest doesn't hold. What doesn't hold between others that do isn't seen if its interval
// is narrower than a step.
template <typename Holds>
std::optional<double> smallest_from_above(Holds holds, double largest, double least, double close_enough) {
  constexpr double step = 1.4;
  if (!holds(largest)) return std::nullopt;
  double high = largest, low = high / step;
  while (low > least && holds(low)) {
    high = low;
    low /= step;
  }
  while (high > close_enough * low && low > least) {
    const double middle = std::sqrt(low * high);
    (holds(middle) ? high : low) = middle;
  }
  return high;
}

}  // namespace proxarm::controller
