// A world of your own that names its objects and places its contacts, which a GeometricAlgorithm<3> cannot.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "models/geometry/geometric_algorithm.hpp"

namespace proxarm {

// contacts() says what touches. Without contacts the proxy counts as free, whatever force acts on it: a detent or a
// medium is no touch. A contact's object is an index of objects().
class OwnWorld : public models::GeometricAlgorithm<3> {
 public:
  // The names of the objects; empty: contacts have numbers only.
  [[nodiscard]] virtual std::vector<std::string> objects() const { return {}; }

  // The points of contacts() in W, in their order. Contacts without a point are at the proxy.
  [[nodiscard]] virtual std::span<const models::Vec3> contact_points_W() const noexcept { return {}; }
};

}  // namespace proxarm
