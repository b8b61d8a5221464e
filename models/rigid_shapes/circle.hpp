// Finds where on a circle a quadratic function has its local maxima. A rim uses this to find its places nearest to a
// surface.
//
//   f(z) = b_x z_x + b_y z_y − ½ D z_y²   in the axes x, y, with ‖z‖ = 1 and D ≥ 0
//
// 1. The slope of f along the circle vanishes where b_y/z_y − b_x/z_x = D.
// 2. In the quadrant that contains b, this equation has one root, which is the global maximum.
// 3. In that quadrant's mirror image at the y axis, there is a second local maximum if b lies inside the astroid
//    |b_x|^⅔ + |b_y|^⅔ = D^⅔, the evolute of an ellipse.
// 4. There are no other local maxima.
#pragma once

#include <Eigen/Core>
#include <array>

namespace proxarm::models {

using Vec2 = Eigen::Vector2d;

// Finds the local maxima for b, given in the axes. `out` gets their places as unit vectors in the axes, the global
// maximum first. Returns their number, 1 or 2.
int highest_on_circle(const Vec2& b, double D, std::array<Vec2, 2>& out) noexcept;

}  // namespace proxarm::models
