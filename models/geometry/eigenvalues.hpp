// Eigenvalues of matrices, small and large. Eigen would compile its iterative solvers anew, for seconds, in every
// source that uses one.
#pragma once

#include "models/geometry/geometry.hpp"
#include "models/geometry/small_matrix.hpp"

namespace proxarm::models {

// The largest |λ| of a square matrix. This and the next two functions take matrices of any size and allocate.
double spectral_radius(const Eigen::MatrixXd& A);
Eigen::VectorXcd eigenvalues(const Eigen::MatrixXd& A);
// λ of K v = λ M v, ascending. Precondition: K is symmetric, M symmetric and positive definite, of the same size.
Eigen::VectorXd generalized_eigenvalues(const Eigen::MatrixXd& K, const Eigen::MatrixXd& M);

// λ of A v = λ v, ascending. Precondition: A is symmetric.
SmallVector symmetric_eigenvalues(const SmallMatrix& A) noexcept;

// A = V diag(λ) Vᵀ, λ ascending. Precondition: A is symmetric.
struct SymmetricEigen {
  Vec<6> values;
  Mat6 vectors;
};
SymmetricEigen symmetric_eigen(const Mat6& A) noexcept;

// The smallest singular value of a matrix with three rows, as √λ of A Aᵀ. Error about 1e-8 of the largest singular
// value.
double smallest_singular_value(
    const Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::ColMajor, 3, most_rows>& A) noexcept;

}  // namespace proxarm::models
