// The local problem at a pose, with its contacts and their solution.
#pragma once

#include <array>

#include "models/geometry/small_matrix.hpp"
#include "models/local_problem/contact_problem.hpp"

namespace proxarm::models {

// A step of the iteration that counts as none, m. With bends, at a clearance of ten micrometres, it turns normals by at
// most 1e-10 rad.
inline constexpr double kStill_m = 1e-15;

struct LocalProblem {
  Mat6 K = Mat6::Identity();
  ContactProblem problem;
  std::array<LinearContact, ContactProblem::most> contacts;
  std::array<std::uint16_t, ContactProblem::most> touch_of{};  // index in Touches, of each contact
  std::array<Mat3, ContactProblem::most> axes;                 // normal and two tangents, columns, of each contact
  std::size_t count = 0;
  bool lies_along = false;  // straight features, one of them round, pressed along each other in the last solution
  bool kept = false;        // the last solution has the forces of the one before
};

// A force in axes of normal and tangents, N, put into the Coulomb cone.
[[nodiscard]] Vec3 in_cone(Vec3 f, double mu) noexcept;

}  // namespace proxarm::models
