// Random numbers for tests: a seed that stands in the test, and a count that the environment scales.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <random>

#include "models/geometry/geometry.hpp"

namespace proxarm::tests {

// `count` at scale 1; PROXARM_TEST_SCALE (a number, default 1) multiplies it, down to at least one.
inline std::int64_t scaled(double count) {
  const char* text = std::getenv("PROXARM_TEST_SCALE");
  const double scale = text != nullptr ? std::atof(text) : 1.0;
  return std::max<std::int64_t>(1, static_cast<std::int64_t>(count * (scale > 0.0 ? scale : 1.0)));
}

// The same for what has to be met often enough to tell anything: never fewer than `least`.
inline std::int64_t scaled(double count, std::int64_t least) { return std::max(scaled(count), least); }

class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) { testing::Test::RecordProperty("seed", std::to_string(seed)); }

  double uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(engine_); }
  double log_uniform(double low, double high) { return std::exp(uniform(std::log(low), std::log(high))); }
  bool chance(double probability) { return uniform(0.0, 1.0) < probability; }
  int below(int n) { return std::uniform_int_distribution<int>(0, n - 1)(engine_); }

  template <int N>
  models::Vec<N> in_box(double half) {
    models::Vec<N> v;
    for (int i = 0; i < N; ++i) v[i] = uniform(-half, half);
    return v;
  }

  template <int N>
  models::Vec<N> direction() {
    std::normal_distribution<double> normal;
    models::Vec<N> v;
    do {
      for (int i = 0; i < N; ++i) v[i] = normal(engine_);
    } while (!(v.norm() > 1e-3));
    return v.normalized();
  }

 private:
  std::mt19937_64 engine_;
};

}  // namespace proxarm::tests
