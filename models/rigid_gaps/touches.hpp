// Stores the touches of all pairs at a pose.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>

#include "models/rigid_shapes/touch.hpp"

namespace proxarm::models {

struct Found {
  Touch touch;             // in W
  std::uint16_t pair = 0;  // index in Candidates
  std::uint8_t which = 0;  // which place of a pair that touches at several places
  bool working = false;    // the touch is in the local problem
  bool over = false;       // the foot lies beyond a valley or an edge's end
};

struct Touches {
  static constexpr std::size_t most = 512;
  static constexpr double everywhere_m = std::numeric_limits<double>::infinity();

  [[nodiscard]] std::span<Found> all() noexcept { return std::span(found).first(count); }
  [[nodiscard]] std::span<const Found> all() const noexcept { return std::span(found).first(count); }

  std::array<Found, most> found;
  std::size_t count = 0;
  double within_m = 0.0;  // the touches are complete as long as the tool moves on by at most this
};

}  // namespace proxarm::models
