#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "models/geometry/eigenvalues.hpp"

namespace proxarm::models {

// Runs the algorithm of SelfAdjointEigenSolver::compute() without its part for eigenvectors.
SmallVector symmetric_eigenvalues(const SmallMatrix& A) noexcept {
  const double largest = A.cwiseAbs().maxCoeff(), scale = largest > 0.0 ? largest : 1.0;
  const Eigen::Tridiagonalization<SmallMatrix> tridiagonal(A / scale);
  Eigen::SelfAdjointEigenSolver<SmallMatrix> solver;
  solver.computeFromTridiagonal(tridiagonal.diagonal(), tridiagonal.subDiagonal(), Eigen::EigenvaluesOnly);
  return scale * solver.eigenvalues();
}

SymmetricEigen symmetric_eigen(const Mat6& A) noexcept {
  const Eigen::SelfAdjointEigenSolver<Mat6> solver(A);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

double smallest_singular_value(
    const Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::ColMajor, 3, most_rows>& A) noexcept {
  const Mat3 squares = A.lazyProduct(A.transpose());
  return std::sqrt(
      std::max(0.0, Eigen::SelfAdjointEigenSolver<Mat3>(squares, Eigen::EigenvaluesOnly).eigenvalues()[0]));
}

}  // namespace proxarm::models
