// A world of one's own that says more of its contacts than a GeometricAlgorithm<3> can.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "models/geometry/geometric_algorithm.hpp"

namespace proxarm {

// A world says by contacts() what touches: without any, the proxy counts as free, whatever force acts on it, so a
// detent or a medium is no touch. Contacts name their object by its index among objects().
class OwnWorld : public models::GeometricAlgorithm<3> {
 public:
  // Empty: its contacts have numbers only.
  [[nodiscard]] virtual std::vector<std::string> objects() const { return {}; }

  // Where those of contacts() are, in W and in their order. Of those without one: where the proxy is.
  [[nodiscard]] virtual std::span<const models::Vec3> contact_points_W() const noexcept { return {}; }
};

}  // namespace proxarm
