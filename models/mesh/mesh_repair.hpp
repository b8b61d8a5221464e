// What programs leave in a mesh file that means one surface and isn't written as one: corners of neighbours that differ
// by rounding, and faces that are there more than once.
//
// A proxy falls through any crack. So corners on borders (edges with a face on one side only) that lie within a
// tolerance become one corner. A corner without a border is never moved: a closed mesh stays as it is, whatever the
// tolerance.
#pragma once

#include <cstdint>

#include "models/mesh/mesh.hpp"

namespace proxarm::models {

struct WeldedCorners {
  std::uint64_t corners = 0;    // that became others
  double apart_m = 0.0;         // farthest that one of them was moved
  std::uint64_t collapsed = 0;  // triangles smaller than the tolerance that became a point or a line
};

// Merges corners on borders that lie within `within_m` of each other, the nearest first, into the one with the least
// index.
//   - All corners that become one fit into a box with a diagonal of within_m: chains of near corners don't run
//   together.
//   - Two corners of one triangle don't become one, unless all its sides are within within_m. Such a triangle is left
//     out and counted.
// Precondition: vertices with the same coordinates are one vertex, as in TriangleMesh::structure().
WeldedCorners weld_borders(TriangleSoup& soup, double within_m);

struct RepeatedFaces {
  std::uint64_t same = 0;      // left out: another face has the same corners and the same front
  std::uint64_t opposite = 0;  // left out: another face has the same corners and the opposite front
};

// Leaves one face of those with the same three corners and the same front. Where both fronts are there, they are one
// surface, too, unless faces with one front join it somewhere: a wall between two bodies that touch keeps both of its
// faces. Of a double-sided surface the fronts that are kept agree with each other, and are outside of a closed one.
// Precondition: as above.
RepeatedFaces leave_out_repeated(TriangleSoup& soup);

// How far corners may lie apart and still be one by default: the last written digit of a text file, and 2⁻¹⁶ of the
// largest coordinate, both in the file's unit.
//
// Of the digit: copies of one corner, each rounded to a digit d, differ by at most d an axis: √3 d. 1.75 d leaves a
// hundredth of it to the rounding of coordinates in W. A file with short numbers ("v 0 1 0") says nothing of its
// rounding: d counts up to 2⁻¹⁰ of the largest coordinate.
// Of 2⁻¹⁶: most mesh programs compute in single precision, with an error of 2⁻²⁴ of the largest coordinate for each
// operation. A corner that is computed once for each of its faces, by transformations and intersections of some tens of
// operations each, differs by up to 2⁸ of those. In a part of 0.1 m about the origin that is 1.5 µm. Smaller: cracks of
// such programs stay open. Larger: slits that are meant are closed.
double default_weld(double largest_coordinate, double last_digit) noexcept;

}  // namespace proxarm::models
