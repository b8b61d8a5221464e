// Products, inverses and linear systems of matrices of any size, which allocate: for what is computed before a session.
// Eigen's forms of these are blocked for large matrices and compiled anew, for seconds, in every source that writes
// them: whoever needs them asks here. The numbers are Eigen's to the bit.
#pragma once

#include "models/geometry/geometry.hpp"

namespace proxarm::models {

// A B. Precondition: A has as many columns as B has rows.
Eigen::MatrixXd product(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B);
// Aᵀ B. Precondition: A has as many rows as B.
Eigen::MatrixXd transposed_product(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B);
// A⁻¹ by partial pivoting. A singular A gives results that aren't finite.
Eigen::MatrixXd inverse(const Eigen::MatrixXd& A);
// A⁻¹ B by Cholesky's decomposition. Precondition: A is symmetric and positive definite.
Eigen::MatrixXd solve_positive_definite(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B);

}  // namespace proxarm::models
