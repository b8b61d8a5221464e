// Displacement of a point of the tool by a twist (translation, rotation about the reference point): G ξ.
#pragma once

#include "models/geometry/geometry.hpp"
#include "models/geometry/small_matrix.hpp"

namespace proxarm::models {

// G = [I, −lever×], 3 × 6, with the lever from the reference point to the point, m.
inline Eigen::Matrix<double, 3, 6> motion_of_point(const Vec3& lever) noexcept {
  Eigen::Matrix<double, 3, 6> G;
  G.leftCols<3>().setIdentity();
  G.rightCols<3>() << 0.0, lever.z(), -lever.y(), -lever.z(), 0.0, lever.x(), lever.y(), -lever.x(), 0.0;
  return G;
}

}  // namespace proxarm::models
