// Eigenvalues of matrices of any size. They stand here because Eigen's iterative solvers are compiled anew for every
// type that asks for them, each for seconds: what isn't in the cycle asks here. These functions allocate.
#pragma once

#include <Eigen/Core>

namespace proxarm::models {

// The largest |λ| of a square matrix.
double spectral_radius(const Eigen::MatrixXd& A);

// λ of K v = λ M v, ascending. Precondition: K is symmetric, M symmetric and positive definite.
Eigen::VectorXd generalized_eigenvalues(const Eigen::MatrixXd& K, const Eigen::MatrixXd& M);

}  // namespace proxarm::models
