// Two straight features of which one is round: a cylinder's side or a round edge, along another side or edge.
//
// They touch where the axes come nearest, D apart, at s and t along them. D's second derivatives over the pose q and
// over s and t, with u and v the axes and P across the normal:
//
//   D_qq = GᵀPG/D,  D_qs = [0; u × n] + GᵀPu/D,  D_qt = −GᵀPv/D,  D_ss = D_tt = 1/D,  D_st = −uᵀv/D
//
// If they are nearly parallel, the place goes far along them with next to no turn.
#pragma once

#include <optional>

#include "models/geometry/small_matrix.hpp"
#include "models/rigid_bodies/rigid_bodies.hpp"

namespace proxarm::models {

struct NearSides {
  Vec3 u, v;  // unit, in W
  double own_radius = 0.0, D = 0.0, sine2 = 0.0;
  Mat3 P;
  Eigen::Matrix<double, 3, 6> G;      // displacement of the place on the tool's axis by a twist
  Eigen::Matrix<double, 6, 2> along;  // D_qs, D_qt
  Eigen::Matrix2d inverse;            // of [D_ss D_st; D_st D_tt], times sine²/D

  // Displacement of the place along the tool's axis by a twist of the tool.
  [[nodiscard]] Vec3 way(const Twist& delta) const noexcept;
};

// Nothing if the two are parallel. Precondition: is_along_side(pair.kind).
[[nodiscard]] std::optional<NearSides> near_sides(const RigidBodies& bodies, const Pair& pair, const Touch& touch,
                                                  const ToolPose& pose) noexcept;
// Puts a touch to where the last solution expected it, `last_W`, if the pose can't tell the place any better.
void stay_along_side(const RigidBodies& bodies, const Pair& pair, const ToolPose& pose, const Vec3& last_W,
                     Touch& touch) noexcept;

}  // namespace proxarm::models
