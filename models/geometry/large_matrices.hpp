// Products, inverses and linear systems of matrices of any size, for work before a session, because these functions
// allocate. They exist because Eigen's blocked algorithms would take seconds to compile in every source that used them.
// The results equal Eigen's to the bit.
#pragma once

#include "models/geometry/geometry.hpp"

namespace proxarm::models {

// Returns A B. Precondition: A has as many columns as B has rows.
Eigen::MatrixXd product(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B);
// Returns Aᵀ B. Precondition: A has as many rows as B.
Eigen::MatrixXd transposed_product(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B);
// Returns A⁻¹, by partial pivoting. The result isn't finite if A is singular.
Eigen::MatrixXd inverse(const Eigen::MatrixXd& A);
// Returns A⁻¹ B, by Cholesky decomposition. Precondition: A is symmetric and positive definite.
Eigen::MatrixXd solve_positive_definite(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B);

}  // namespace proxarm::models
