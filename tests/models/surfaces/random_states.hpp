// Random numbers for tests: a seed that stands in the test, and a count that the environment scales.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "models/base/random.hpp"

namespace proxarm::tests {

// `count` at scale 1; PROXARM_TEST_SCALE (a number, default 1) multiplies it, down to at least one.
inline std::int64_t scaled(double count) {
  const char* text = std::getenv("PROXARM_TEST_SCALE");
  const double scale = text != nullptr ? std::atof(text) : 1.0;
  return std::max<std::int64_t>(1, static_cast<std::int64_t>(count * (scale > 0.0 ? scale : 1.0)));
}

// The same for what has to be met often enough to tell anything: never fewer than `least`.
inline std::int64_t scaled(double count, std::int64_t least) { return std::max(scaled(count), least); }

// The project's own random numbers; the seed is among the test's properties.
class Random : public models::Random {
 public:
  explicit Random(std::uint64_t seed) : models::Random(seed) {
    testing::Test::RecordProperty("seed", std::to_string(seed));
  }
};

}  // namespace proxarm::tests
