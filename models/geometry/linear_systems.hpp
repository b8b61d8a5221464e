// Solves linear systems A x = b of the sizes that occur in the cycle. Nothing here allocates. The functions exist
// because Eigen's decompositions would take seconds to compile in every source that used them.
#pragma once

#include <Eigen/LU>
#include <array>
#include <optional>

#include "models/geometry/geometry.hpp"
#include "models/geometry/small_matrix.hpp"

namespace proxarm::models {

// Returns A⁻¹ B, by Cholesky decomposition. Precondition: A is symmetric and positive definite.
Eigen::Matrix<double, 6, 3> solve_positive_definite(const Mat6& A, const Eigen::Matrix<double, 6, 3>& B) noexcept;
SmallColumns3 solve_positive_definite(const SmallMatrix& A, const SmallColumns3& B) noexcept;
SmallMatrix solve_positive_definite(const SmallMatrix& A, const SmallMatrix& B) noexcept;

// The decomposition P A = L U with partial pivoting. Results aren't finite if A is singular. The factors equal those of
// Eigen::PartialPivLU to the bit. As the size is fixed, factor() takes a sixth of PartialPivLU's instructions.
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

  // Contains U, and below U's diagonal L without the ones on L's diagonal.
  Mat6 lu_ = Mat6::Identity();
  std::array<int, 6> rows_{0, 1, 2, 3, 4, 5};  // row i of L U is row rows_[i] of A
};

// Returns A⁻¹ b, by partial pivoting, for N = 6 and 9.
template <int N>
Vec<N> solve_square(const Eigen::Matrix<double, N, N>& A, const Vec<N>& b) noexcept;
extern template Vec<6> solve_square<6>(const Mat6& A, const Vec<6>& b) noexcept;
extern template Vec<9> solve_square<9>(const Eigen::Matrix<double, 9, 9>& A, const Vec<9>& b) noexcept;

// Returns A⁻¹, by full pivoting, or nullopt if A is singular.
std::optional<Mat6> inverse_if_regular(const Mat6& A) noexcept;

// Returns the least-squares solution of A x = b for up to 36 rows, by QR with column pivoting. A may be singular.
constexpr int most_equations = 36;
using Equations =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, most_equations, most_equations>;
using Unknowns = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, most_equations, 1>;
Unknowns solve_least_squares(const Equations& A, const Unknowns& b) noexcept;

}  // namespace proxarm::models
