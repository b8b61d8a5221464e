// Generates random numbers that are equal on every machine and with every compiler. From <random> it uses only the
// engine, because the standard defines the engine's output. Published figures, tests and `check` depend on the
// sequence.
//
// An instance may be used by one thread at a time. Nothing here allocates.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <random>

namespace proxarm::models {

class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}

  // Returns a number in [low, high): low + (high − low) u, where u is made from the upper 53 bits of the engine's
  // output.
  double uniform(double low, double high) {
    return low + (high - low) * (static_cast<double>(engine_() >> 11) * 0x1p-53);
  }
  // Returns a number whose logarithm is uniformly distributed. Precondition: low and high are above 0.
  double log_uniform(double low, double high) { return std::exp(uniform(std::log(low), std::log(high))); }
  bool chance(double probability) { return uniform(0.0, 1.0) < probability; }
  // Returns a number from 0 to n − 1. Precondition: n > 0.
  int below(int n) { return static_cast<int>(uniform(0.0, static_cast<double>(n))); }

  // Returns a vector whose coordinates are each in [−half, half).
  template <int N = 3>
  Eigen::Matrix<double, N, 1> in_box(double half) {
    Eigen::Matrix<double, N, 1> v;
    for (int i = 0; i < N; ++i) v[i] = uniform(-half, half);
    return v;
  }
  // Returns a unit vector, uniformly distributed over all directions. It is computed from a point in the unit ball;
  // points outside the ball or near its centre are rejected.
  template <int N = 3>
  Eigen::Matrix<double, N, 1> direction() {
    for (;;) {
      const Eigen::Matrix<double, N, 1> v = in_box<N>(1.0);
      const double size = v.norm();
      if (size > 0.1 && size <= 1.0) return v / size;
    }
  }
  // Returns a random direction times a random length. The length is drawn first, in a separate statement, because the
  // order in which the operands of a product are evaluated is unspecified.
  Eigen::Vector3d arrow(double shortest, double longest) {
    const double length = uniform(shortest, longest);
    return length * direction();
  }
  Eigen::Vector3d log_arrow(double shortest, double longest) {
    const double length = log_uniform(shortest, longest);
    return length * direction();
  }

 private:
  std::mt19937_64 engine_;
};

}  // namespace proxarm::models
