// Repairs meshes that represent one surface, but whose files don't: neighbouring faces have corners that differ by
// rounding, or faces are repeated.
//
// A proxy falls through any crack. So if corners on borders are within a tolerance of each other, they become one
// corner. (A border is an edge with a face on one side only.) Other corners never move, so a closed mesh stays
// unchanged at any tolerance.
#pragma once

#include <cstdint>

#include "models/mesh/mesh.hpp"

namespace proxarm::models {

struct WeldedCorners {
  std::uint64_t corners = 0;    // number of corners merged into other corners
  double apart_m = 0.0;         // largest distance that a merged corner moved
  std::uint64_t collapsed = 0;  // triangles smaller than the tolerance that became a point or a line
};

// Merges corners on borders that are within `within_m` of each other, the nearest corners first. Merged corners take
// the position of the corner with the least index.
//   - All corners that become one fit into a box with a diagonal of within_m, so a chain of near corners doesn't
//     collapse.
//   - Two corners of one triangle don't become one, unless all sides of the triangle are at most within_m long. Such a
//     small triangle is left out and counted.
// Precondition: vertices with the same coordinates are one vertex, as in TriangleMesh::structure().
WeldedCorners weld_borders(TriangleSoup& soup, double within_m);

struct RepeatedFaces {
  // Faces left out because another face has the same corners and the same front.
  std::uint64_t same = 0;
  // Faces left out because another face has the same corners and the opposite front.
  std::uint64_t opposite = 0;
};

// Keeps one of several faces with the same three corners and the same front. Of two faces with the same corners and
// opposite fronts it also keeps only one, unless faces with only one front join their surface: a wall between two
// bodies that touch keeps both faces. The remaining fronts of a double-sided surface agree with each other; on a closed
// surface they are outside. Precondition: vertices with the same coordinates are one vertex.
RepeatedFaces leave_out_repeated(TriangleSoup& soup);

// Returns the default distance within which corners count as one. It is the larger of two distances: one from the last
// written digit of a text file, and one of 2⁻¹⁶ of the largest coordinate. Both arguments and the result are in the
// file's unit.
//
// The last digit: copies of one corner, each rounded to a digit d, differ by at most d on each axis, so by √3 d in all.
// The function uses 1.75 d, which leaves a hundredth of √3 d for rounding in W. In a file with short numbers ("v 0 1
// 0") the last digit says nothing about rounding, so d is limited to 2⁻¹⁰ of the largest coordinate.
//
// The 2⁻¹⁶:
// 1. Most mesh programs compute in single precision, with an error of 2⁻²⁴ of the largest coordinate per operation.
// 2. If such a program computes a corner separately for each of the corner's faces, by some tens of operations, the
//    copies differ by up to 2⁸ of these errors: 2⁻¹⁶ of the largest coordinate.
// 3. In a part of 0.1 m about the origin, this is 1.5 µm. A smaller distance would leave cracks of such programs open;
//    a larger distance would close intended slits.
double default_weld(double largest_coordinate, double last_digit) noexcept;

}  // namespace proxarm::models
