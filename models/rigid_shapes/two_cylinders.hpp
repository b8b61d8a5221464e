// Where the features of two cylinders with flat ends come near each other, in one frame.
//
//   side, side      as two capsules, where the nearest points of the axes lie inside of both
//   rim, side       where the rim comes nearest to the other one's axis
//   rim, end        the rim's lowest point over the end, or four where it is nearly level
//   rim, rim        where their distance is least; they hold in the directions between side and end of both
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "models/rigid_shapes/cylinder.hpp"

namespace proxarm::models {

// Of all: on_cylinder is the place on the first one, on_other on the second, `out` from the first to the second.
std::optional<Meeting> meet_sides(const Cylinder& a, const Cylinder& b, double beside) noexcept;
// A rim of b at the side or at an end of a. The nearest first; return their number.
int meet_rim_and_side(const Cylinder& a, const Cylinder& b, std::uint32_t rim, double beside,
                      std::array<Meeting, 4>& out) noexcept;
int meet_rim_and_end(const Cylinder& a, std::uint32_t end, const Cylinder& b, std::uint32_t rim, const Vec2& level,
                     double beside, std::array<Meeting, 4>& out) noexcept;
int meet_rims(const Cylinder& a, std::uint32_t rim_a, const Cylinder& b, std::uint32_t rim_b,
              std::array<Meeting, 4>& out) noexcept;

// From the first rim to the second, at the place nearest to one in the first one's u and v, whatever is beside them.
double height_of_rims(const Cylinder& a, std::uint32_t rim_a, const Cylinder& b, std::uint32_t rim_b,
                      const Vec2& place) noexcept;

// As separation_of_cylinder().
double separation_of_cylinders(const Cylinder& a, const Cylinder& b) noexcept;

}  // namespace proxarm::models
