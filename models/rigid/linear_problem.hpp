// Stores the local problem at a pose, its contacts and their solution.
#pragma once

#include <array>

#include "models/geometry/small_matrix.hpp"
#include "models/local_problem/contact_problem.hpp"

namespace proxarm::models {

// A step of the iteration below this size counts as zero, m. With bends and a clearance of ten micrometres, such a step
// turns normals by at most 1e-10 rad.
inline constexpr double kStill_m = 1e-15;

struct LocalProblem {
  Mat6 K = Mat6::Identity();
  ContactProblem problem;
  std::array<LinearContact, ContactProblem::most> contacts;
  std::array<std::uint16_t, ContactProblem::most> touch_of{};  // for each contact its index in Touches
  std::array<Mat3, ContactProblem::most> axes;  // for each contact the normal and two tangents, as columns
  std::size_t count = 0;
  bool lies_along = false;  // in the last solution a pair with is_along_side() pressed
  bool kept = false;        // the last solution has the forces of the solution before
};

// Returns the force f (normal, tangents; N) after moving it into the Coulomb cone: a tension becomes 0, and the
// tangential part is shortened.
[[nodiscard]] Vec3 in_cone(Vec3 f, double mu) noexcept;

}  // namespace proxarm::models
