#include "models/geometry/eigenvalues.hpp"

#include <Eigen/Eigenvalues>

namespace proxarm::models {

double spectral_radius(const Eigen::MatrixXd& A) { return eigenvalues(A).cwiseAbs().maxCoeff(); }

Eigen::VectorXcd eigenvalues(const Eigen::MatrixXd& A) {
  return Eigen::EigenSolver<Eigen::MatrixXd>(A, false).eigenvalues();
}

Eigen::VectorXd generalized_eigenvalues(const Eigen::MatrixXd& K, const Eigen::MatrixXd& M) {
  return Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd>(K, M, Eigen::EigenvaluesOnly).eigenvalues();
}

}  // namespace proxarm::models
