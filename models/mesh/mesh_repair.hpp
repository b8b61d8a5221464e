// Repairs meshes that mean one surface but aren't written as one: neighbours' corners that differ by rounding, and
// repeated faces.
//
// A proxy falls through any crack. So corners on borders (edges with a face on one side only) that lie within a
// tolerance become one corner. Other corners are never moved: a closed mesh stays as it is, at any tolerance.
#pragma once

#include <cstdint>

#include "models/mesh/mesh.hpp"

namespace proxarm::models {

struct WeldedCorners {
  std::uint64_t corners = 0;    // number merged into others
  double apart_m = 0.0;         // largest distance that one of them moved
  std::uint64_t collapsed = 0;  // triangles smaller than the tolerance that became a point or a line
};

// Merges corners on borders that lie within `within_m` of each other, the nearest first, into the one with the least
// index.
//   - All corners that become one fit into a box with a diagonal of within_m, so chains of near corners don't collapse.
//   - Two corners of one triangle don't become one, unless all its sides are within within_m. Such a triangle is left
//     out and counted.
// Precondition: vertices with the same coordinates are one vertex, as in TriangleMesh::structure().
WeldedCorners weld_borders(TriangleSoup& soup, double within_m);

struct RepeatedFaces {
  std::uint64_t same = 0;      // left out: another face has the same corners and the same front
  std::uint64_t opposite = 0;  // left out: another face has the same corners and the opposite front
};

// Keeps one of the faces with the same three corners and the same front. Faces with both fronts become one as well,
// unless faces with only one front join their surface somewhere: a wall between two bodies that touch keeps both. The
// fronts kept of a double-sided surface agree with each other; on a closed one they are outside. Precondition: as
// above.
RepeatedFaces leave_out_repeated(TriangleSoup& soup);

// The default distance within which corners count as one, from the last written digit of a text file and from 2⁻¹⁶ of
// the largest coordinate, both in the file's unit.
//
// Last digit: copies of one corner, each rounded to a digit d, differ by at most d on each axis, √3 d in all. 1.75 d
// leaves a hundredth of that for rounding in W. A file with short numbers ("v 0 1 0") says nothing about its rounding,
// so d counts only up to 2⁻¹⁰ of the largest coordinate.
//
// 2⁻¹⁶: most mesh programs compute in single precision, with an error of 2⁻²⁴ of the largest coordinate per operation.
// If they compute a corner separately for each of its faces, by some tens of operations, the copies differ by up to 2⁸
// of those errors. In a part of 0.1 m about the origin that is 1.5 µm. Smaller: cracks of such programs stay open.
// Larger: intended slits are closed.
double default_weld(double largest_coordinate, double last_digit) noexcept;

}  // namespace proxarm::models
