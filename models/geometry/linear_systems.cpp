#include "models/geometry/linear_systems.hpp"

#include <Eigen/QR>
#include <cmath>
#include <utility>

namespace proxarm::models {

// Computes column k of L and row k of U. Template recursion makes the loop bounds constant, so that they are unrolled.
template <int k>
void FactoredMatrix::eliminate() noexcept {
  int pivot = k;
  for (int i = k + 1; i < 6; ++i) {
    if (std::abs(lu_(i, k)) > std::abs(lu_(pivot, k))) pivot = i;
  }
  if (pivot != k) {
    lu_.row(k).swap(lu_.row(pivot));
    std::swap(rows_[k], rows_[static_cast<std::size_t>(pivot)]);
  }
  if constexpr (k < 5) {
    constexpr int below = 5 - k;
    auto L = lu_.col(k).tail<below>();
    if (lu_(k, k) != 0.0) L /= lu_(k, k);
    for (int j = k + 1; j < 6; ++j) lu_.col(j).tail<below>() -= lu_(k, j) * L;
    eliminate<k + 1>();
  }
}

void FactoredMatrix::factor(const Mat6& A) noexcept {
  lu_ = A;
  rows_ = {0, 1, 2, 3, 4, 5};
  eliminate<0>();
}

template <typename Columns>
Columns FactoredMatrix::solve_columns(const Columns& B) const noexcept {
  Columns X;
  for (int i = 0; i < 6; ++i) X.row(i) = B.row(rows_[static_cast<std::size_t>(i)]);
  lu_.triangularView<Eigen::UnitLower>().solveInPlace(X);
  lu_.triangularView<Eigen::Upper>().solveInPlace(X);
  return X;
}

Vec<6> FactoredMatrix::solve(const Vec<6>& b) const noexcept { return solve_columns(b); }

Mat6 FactoredMatrix::inverse() const noexcept { return solve_columns<Mat6>(Mat6::Identity()); }

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

// Runs the algorithm of ColPivHouseholderQR::solve() without its call of householderQ(). That call would compile an
// algorithm in blocks for more than 48 rows, and with it all of Eigen's large products.
Unknowns solve_least_squares(const Equations& A, const Unknowns& b) noexcept {
  const Eigen::ColPivHouseholderQR<Equations> qr(A);
  const Eigen::Index rank = qr.nonzeroPivots();
  Unknowns c = b;  // becomes Qᵀ b
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
