// Renders an empty world: the proxy goes to p.
//
//   𝒢(K, p, q) = p,   ℳ(q, q̇) = o
#pragma once

#include "models/geometry/geometric_algorithm.hpp"

namespace proxarm::models {

template <int N>
class FreeSpace final : public GeometricAlgorithm<N> {
 public:
  Vec<N> operator()(double /*K*/, const Vec<N>& p, const Vec<N>& /*q*/) noexcept override { return p; }
  [[nodiscard]] bool wants_time() const noexcept override { return false; }
};

}  // namespace proxarm::models
