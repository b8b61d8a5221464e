// Computes how the place of contact of two straight features moves. At least one feature is round: a cylinder's side or
// a round edge, along another side or edge.
//
// The features touch where their axes come nearest: at the coordinates s and t along the unit axes u and v, at the
// distance D. P is the projection perpendicular to the normal. The second derivatives of D with respect to the pose q,
// s and t are:
//
//   D_qq = GᵀPG/D,  D_qs = [0; u × n] + GᵀPu/D,  D_qt = −GᵀPv/D,  D_ss = D_tt = 1/D,  D_st = −uᵀv/D
//
// If the axes are nearly parallel, a very small turn moves the place far along the axes.
#pragma once

#include <optional>

#include "models/geometry/small_matrix.hpp"
#include "models/rigid_bodies/rigid_bodies.hpp"

namespace proxarm::models {

struct NearSides {
  Vec3 u, v;  // unit vectors along the axes, in W
  double own_radius = 0.0, D = 0.0, sine2 = 0.0;
  Mat3 P;
  Eigen::Matrix<double, 3, 6> G;      // displacement of the place on the tool's axis by a twist
  Eigen::Matrix<double, 6, 2> along;  // D_qs, D_qt
  Eigen::Matrix2d inverse;            // inverse of [D_ss D_st; D_st D_tt], times sine²/D

  // Returns the displacement of the place of contact along the tool's axis by a twist of the tool, in W.
  [[nodiscard]] Vec3 way(const Twist& delta) const noexcept;
};

// Returns nullopt if the features are parallel. Precondition: is_along_side(pair.kind).
[[nodiscard]] std::optional<NearSides> near_sides(const RigidBodies& bodies, const Pair& pair, const Touch& touch,
                                                  const ToolPose& pose) noexcept;
// Moves a touch to `last_W`, where the last solution put it, if the pose doesn't determine the place more accurately.
void stay_along_side(const RigidBodies& bodies, const Pair& pair, const ToolPose& pose, const Vec3& last_W,
                     Touch& touch) noexcept;

}  // namespace proxarm::models
