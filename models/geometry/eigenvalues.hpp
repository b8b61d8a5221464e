// Computes eigenvalues of small and large matrices. The functions exist because Eigen's iterative solvers would take
// seconds to compile in every source that used them.
#pragma once

#include "models/geometry/geometry.hpp"
#include "models/geometry/small_matrix.hpp"

namespace proxarm::models {

// Returns the largest |λ| of a square matrix. This function and the next two take matrices of any size, and allocate.
double spectral_radius(const Eigen::MatrixXd& A);
Eigen::VectorXcd eigenvalues(const Eigen::MatrixXd& A);
// Returns the λ of K v = λ M v, ascending. Precondition: K is symmetric, M is symmetric and positive definite, and both
// have the same size.
Eigen::VectorXd generalized_eigenvalues(const Eigen::MatrixXd& K, const Eigen::MatrixXd& M);

// Returns the λ of A v = λ v, ascending. Precondition: A is symmetric.
SmallVector symmetric_eigenvalues(const SmallMatrix& A) noexcept;

// The decomposition A = V diag(λ) Vᵀ, with λ ascending. Precondition: A is symmetric.
struct SymmetricEigen {
  Vec<6> values;
  Mat6 vectors;
};
SymmetricEigen symmetric_eigen(const Mat6& A) noexcept;

// Returns the smallest singular value of a matrix A with three rows, as the root of the smallest eigenvalue of A Aᵀ.
// The error is about 1e-8 of the largest singular value.
double smallest_singular_value(
    const Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::ColMajor, 3, most_rows>& A) noexcept;

}  // namespace proxarm::models
