// Computes where the features of two cylinders with flat ends come near each other. Both cylinders are in one frame.
//
//   side, side      as two capsules; counts if the nearest points of the axes lie inside both axes
//   rim, side       the place where the rim comes nearest to the axis of the other cylinder
//   rim, end        the rim's lowest point over the end; four points if the rim is nearly level
//   rim, rim        the places at which their distance has a local minimum; they count if the direction lies between
//                   side and end of both cylinders
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "models/rigid_shapes/cylinder.hpp"

namespace proxarm::models {

// In all results, on_cylinder is the place on cylinder a, on_other is the place on cylinder b, and `out` points from a
// to b.
std::optional<Meeting> meet_sides(const Cylinder& a, const Cylinder& b, double beside) noexcept;
// Find the meetings of a rim of b with the side, with an end or with a rim of a, the nearest place first. Return their
// number.
int meet_rim_and_side(const Cylinder& a, const Cylinder& b, std::uint32_t rim, double beside,
                      std::array<Meeting, 4>& out) noexcept;
int meet_rim_and_end(const Cylinder& a, std::uint32_t end, const Cylinder& b, std::uint32_t rim, const Vec2& level,
                     double beside, std::array<Meeting, 4>& out) noexcept;
int meet_rims(const Cylinder& a, std::uint32_t rim_a, const Cylinder& b, std::uint32_t rim_b,
              std::array<Meeting, 4>& out) noexcept;

// Returns the height of the second rim above the first rim, along the direction out of the first rim. Of the places at
// which the rims come near each other, the one closest to `place` (in the first rim's u and v) is used. The height
// doesn't depend on what is beside the rims. NaN if there is no such place.
double height_of_rims(const Cylinder& a, std::uint32_t rim_a, const Cylinder& b, std::uint32_t rim_b,
                      const Vec2& place) noexcept;

// Returns the largest gap that a plane leaves between two cylinders, as separation_of_cylinder() does.
double separation_of_cylinders(const Cylinder& a, const Cylinder& b) noexcept;

}  // namespace proxarm::models
