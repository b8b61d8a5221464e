// The local problem as the Siconos library solves it (nonsmooth Gauss-Seidel): a judge that shares nothing with ours.
#pragma once

#include <vector>

#include "models/local_problem/contact_problem.hpp"

namespace proxarm::models {

// False where the library wasn't there when this was built.
bool siconos_is_there();

// Fills in the forces and δ. False: it has not come to 1e-13, or isn't there.
bool solve_by_siconos(const Mat6& K, const Twist& e, std::vector<LinearContact>& contacts, Twist& delta);

}  // namespace proxarm::models
