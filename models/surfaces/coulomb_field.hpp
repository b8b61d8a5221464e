// Renders dry friction everywhere in space, equation (3): the proxy moves only if a force greater than F acts on it.
//
//   𝒢(K, p, q) = q                                  if ‖p − q‖ ≤ F/K
//                p − (F/K) (p − q)/‖p − q‖          if ‖p − q‖ > F/K        (3)
//
// F > 0 (N) is both the kinetic friction force and the greatest static friction force. ℳ is (16). With (23) or (26),
// (3) gives the friction model of the paper's reference [14].
#pragma once

#include <cmath>
#include <stdexcept>

#include "models/geometry/geometric_algorithm.hpp"

namespace proxarm::models {

template <int N>
class CoulombField final : public GeometricAlgorithm<N> {
 public:
  // Throws std::invalid_argument unless force_N is finite and positive.
  explicit CoulombField(double force_N) : F_(force_N) {
    if (!std::isfinite(force_N) || !(force_N > 0.0)) {
      throw std::invalid_argument("the force of a Coulomb field must be finite and positive");
    }
  }

  Vec<N> operator()(double K, const Vec<N>& p, const Vec<N>& q) noexcept override {
    const Vec<N> d = p - q;
    const double distance = d.norm(), reach = F_ / K;
    // The condition is "not greater", so that the proxy sticks if the square of the distance underflows.
    if (!(distance > reach)) return q;  // (3), first case: q itself, bit for bit
    return p - (reach / distance) * d;  // (3), second case
  }
  [[nodiscard]] bool wants_time() const noexcept override { return false; }

  [[nodiscard]] double force_N() const noexcept { return F_; }

 private:
  double F_;
};

}  // namespace proxarm::models
