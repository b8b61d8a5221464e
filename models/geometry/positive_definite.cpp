#include <Eigen/Cholesky>

#include "models/geometry/linear_systems.hpp"

namespace proxarm::models {

Eigen::Matrix<double, 6, 3> solve_positive_definite(const Mat6& A, const Eigen::Matrix<double, 6, 3>& B) noexcept {
  return A.llt().solve(B);
}

SmallColumns3 solve_positive_definite(const SmallMatrix& A, const SmallColumns3& B) noexcept {
  return A.llt().solve(B);
}

SmallMatrix solve_positive_definite(const SmallMatrix& A, const SmallMatrix& B) noexcept { return A.llt().solve(B); }

}  // namespace proxarm::models
