// Computes the matrix G of a point of the tool: a twist ξ (translation, rotation about the reference point) displaces
// the point by G ξ.
#pragma once

#include "models/geometry/geometry.hpp"
#include "models/geometry/small_matrix.hpp"

namespace proxarm::models {

// Returns G = [I, −lever×], 3 × 6. `lever` leads from the reference point to the point, m.
inline Eigen::Matrix<double, 3, 6> motion_of_point(const Vec3& lever) noexcept {
  Eigen::Matrix<double, 3, 6> G;
  G.leftCols<3>().setIdentity();
  G.rightCols<3>() << 0.0, lever.z(), -lever.y(), -lever.z(), 0.0, lever.x(), lever.y(), -lever.x(), 0.0;
  return G;
}

}  // namespace proxarm::models
