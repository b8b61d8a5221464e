// Eigenvalues. They stand here because Eigen's iterative solvers are compiled anew for every type that asks for them,
// each for seconds: whoever needs them asks here.
#pragma once

#include "models/geometry/geometry.hpp"
#include "models/geometry/small_matrix.hpp"

namespace proxarm::models {

// These three take matrices of any size, and allocate. The largest |λ| of a square matrix:
double spectral_radius(const Eigen::MatrixXd& A);
// All λ of a square matrix.
Eigen::VectorXcd eigenvalues(const Eigen::MatrixXd& A);
// λ of K v = λ M v, ascending. Precondition: K is symmetric, M symmetric and positive definite, of the same size.
Eigen::VectorXd generalized_eigenvalues(const Eigen::MatrixXd& K, const Eigen::MatrixXd& M);

// λ of A v = λ v, ascending. Precondition: A is symmetric, and so below.
SmallVector symmetric_eigenvalues(const SmallMatrix& A) noexcept;

// A = V diag(λ) Vᵀ, λ ascending.
struct SymmetricEigen {
  Vec<6> values;
  Mat6 vectors;
};
SymmetricEigen symmetric_eigen(const Mat6& A) noexcept;

// The smallest singular value of a matrix of three rows, as √λ of A Aᵀ: exact to some 1e-8 of the largest.
double smallest_singular_value(
    const Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::ColMajor, 3, most_rows>& A) noexcept;

}  // namespace proxarm::models
