// Random numbers that are equal on every machine and with every compiler. From <random> it uses only the engine, whose
// output the standard defines. Published figures, tests and `check` depend on the sequence.
//
// One caller at a time. No allocation.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <random>

namespace proxarm::models {

class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}

  // In [low, high): low + (high − low) u, with u from the engine's upper 53 bits.
  double uniform(double low, double high) {
    return low + (high - low) * (static_cast<double>(engine_() >> 11) * 0x1p-53);
  }
  // Uniform in the logarithm. Precondition: both above 0.
  double log_uniform(double low, double high) { return std::exp(uniform(std::log(low), std::log(high))); }
  bool chance(double probability) { return uniform(0.0, 1.0) < probability; }
  // 0 to n − 1. Precondition: n > 0.
  int below(int n) { return static_cast<int>(uniform(0.0, static_cast<double>(n))); }

  // Each coordinate in [−half, half).
  template <int N = 3>
  Eigen::Matrix<double, N, 1> in_box(double half) {
    Eigen::Matrix<double, N, 1> v;
    for (int i = 0; i < N; ++i) v[i] = uniform(-half, half);
    return v;
  }
  // A unit vector, uniform over all directions: from points in the unit ball (rejection), except near its centre.
  template <int N = 3>
  Eigen::Matrix<double, N, 1> direction() {
    for (;;) {
      const Eigen::Matrix<double, N, 1> v = in_box<N>(1.0);
      const double size = v.norm();
      if (size > 0.1 && size <= 1.0) return v / size;
    }
  }
  // A direction times a length. The length is drawn first, because the order in which a product's operands are
  // evaluated is unspecified.
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
