// Where on a circle a quadratic function is largest: how a rim finds the places that come nearest to a surface.
//
//   f(z) = bᵀz − ½ D (xᵀz)²... in the axes x, y:   f = b_x z_x + b_y z_y − ½ D z_y²,   ‖z‖ = 1, D ≥ 0
//
// Its slope along the circle vanishes where b_y/z_y − b_x/z_x = D. In the quadrant of b that has one root, the largest
// value of all. In the quadrant on the other side of the y axis there is a second local maximum where b lies inside of
// the astroid |b_x|^⅔ + |b_y|^⅔ = D^⅔, the evolute of an ellipse, and none elsewhere.
#pragma once

#include <Eigen/Core>
#include <array>

namespace proxarm::models {

using Vec2 = Eigen::Vector2d;

// b in the axes; the places as unit vectors in the axes, the highest first. Returns their number, 1 or 2.
int highest_on_circle(const Vec2& b, double D, std::array<Vec2, 2>& out) noexcept;

}  // namespace proxarm::models
