// Searches for the smallest value of a quantity for which a condition holds.
#pragma once

#include <cmath>
#include <optional>

namespace proxarm::controller {

// Returns the smallest value for which `holds` is true, to a ratio of `close_enough`; nullopt if `largest` fails.
// Divides `largest` by 1.4 until a value fails or is below `least`, then bisects the last step. Misses an interval of
// failing values between holding values if the interval is narrower than a step.
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
