// A x = b for the sizes that the cycle solves. Eigen's decompositions are blocked for large matrices and compiled anew,
// for seconds, in every source that asks for one: whoever needs them asks here. None of these allocates.
#pragma once

#include <Eigen/LU>
#include <array>
#include <optional>

#include "models/geometry/geometry.hpp"
#include "models/geometry/small_matrix.hpp"

namespace proxarm::models {

// By Cholesky's decomposition. Precondition: A is symmetric and positive definite.
Eigen::Matrix<double, 6, 3> solve_positive_definite(const Mat6& A, const Eigen::Matrix<double, 6, 3>& B) noexcept;
SmallColumns3 solve_positive_definite(const SmallMatrix& A, const SmallColumns3& B) noexcept;
SmallMatrix solve_positive_definite(const SmallMatrix& A, const SmallMatrix& B) noexcept;

// P A = L U with partial pivoting. A singular A gives results that aren't finite. The factors are those of
// Eigen::PartialPivLU to the bit, in a sixth of its instructions: that one is written for matrices of any size.
class FactoredMatrix {
 public:
  void factor(const Mat6& A) noexcept;
  [[nodiscard]] Vec<6> solve(const Vec<6>& b) const noexcept;
  [[nodiscard]] Mat6 inverse() const noexcept;

 private:
  template <int k>
  void eliminate() noexcept;
  template <typename Columns>
  [[nodiscard]] Columns solve_columns(const Columns& B) const noexcept;

  Mat6 lu_ = Mat6::Identity();                 // U, and below its diagonal L without its ones
  std::array<int, 6> rows_{0, 1, 2, 3, 4, 5};  // of A, in the order of L U
};

// The same in one go, for N = 6 and 9.
template <int N>
Vec<N> solve_square(const Eigen::Matrix<double, N, N>& A, const Vec<N>& b) noexcept;
extern template Vec<6> solve_square<6>(const Mat6& A, const Vec<6>& b) noexcept;
extern template Vec<9> solve_square<9>(const Eigen::Matrix<double, 9, 9>& A, const Vec<9>& b) noexcept;

// A⁻¹ by full pivoting, or none if A has not full rank.
std::optional<Mat6> inverse_if_regular(const Mat6& A) noexcept;

// A x = b in the sense of least squares, by QR with column pivoting; A may be singular. Up to 36 rows.
constexpr int most_equations = 36;
using Equations =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, most_equations, most_equations>;
using Unknowns = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, most_equations, 1>;
Unknowns solve_least_squares(const Equations& A, const Unknowns& b) noexcept;

}  // namespace proxarm::models
