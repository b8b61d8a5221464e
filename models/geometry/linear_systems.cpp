#include "models/geometry/linear_systems.hpp"

#include <Eigen/QR>

namespace proxarm::models {

void FactoredMatrix::factor(const Mat6& A) noexcept { lu_.compute(A); }

Vec<6> FactoredMatrix::solve(const Vec<6>& b) const noexcept { return lu_.solve(b); }

Mat6 FactoredMatrix::inverse() const noexcept { return lu_.inverse(); }

template <int N>
Vec<N> solve_square(const Eigen::Matrix<double, N, N>& A, const Vec<N>& b) noexcept {
  return A.partialPivLu().solve(b);
}
template Vec<6> solve_square<6>(const Mat6& A, const Vec<6>& b) noexcept;
template Vec<9> solve_square<9>(const Eigen::Matrix<double, 9, 9>& A, const Vec<9>& b) noexcept;

std::optional<Mat6> inverse_if_regular(const Mat6& A) noexcept {
  const Eigen::FullPivLU<Mat6> lu(A);
  if (!lu.isInvertible()) return std::nullopt;
  return lu.inverse();
}

// As ColPivHouseholderQR::solve() does it. Its householderQ() would bring the form along that is blocked for more than
// 48 rows, and with it all of Eigen's large products.
Unknowns solve_least_squares(const Equations& A, const Unknowns& b) noexcept {
  const Eigen::ColPivHouseholderQR<Equations> qr(A);
  const Eigen::Index rank = qr.nonzeroPivots();
  Unknowns c = b;  // to be Qᵀ b
  double workspace = 0.0;
  for (Eigen::Index k = 0; k < rank; ++k) {
    const Eigen::Index below = A.rows() - k;
    c.bottomRightCorner(below, c.cols())
        .applyHouseholderOnTheLeft(qr.matrixQR().col(k).tail(below - 1), qr.hCoeffs()[k], &workspace);
  }
  qr.matrixQR().topLeftCorner(rank, rank).triangularView<Eigen::Upper>().solveInPlace(c.topRows(rank));
  Unknowns x = Unknowns::Zero(A.cols());
  for (Eigen::Index i = 0; i < rank; ++i) x[qr.colsPermutation().indices()[i]] = c[i];
  return x;
}

}  // namespace proxarm::models
