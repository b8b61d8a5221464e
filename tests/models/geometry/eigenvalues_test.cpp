#include "models/geometry/eigenvalues.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace proxarm::models {
namespace {

// Eigenvalues of matrices of this size are exact to some ε times the norm.
constexpr double rounding = 1e-14;

TEST(Eigenvalues, RotationByAnyAngleHasSpectralRadiusOfItsScale) {
  for (const double angle : {0.0, 0.1, 1.0, 3.0}) {
    Eigen::MatrixXd A(2, 2);
    A << std::cos(angle), -std::sin(angle), std::sin(angle), std::cos(angle);
    EXPECT_NEAR(spectral_radius(0.7 * A), 0.7, rounding);
  }
}

TEST(Eigenvalues, NegativeEigenvalueCountsByItsSize) {
  Eigen::MatrixXd A(2, 2);
  A << -3.0, 1.0, 0.0, 2.0;
  EXPECT_NEAR(spectral_radius(A), 3.0, 3.0 * rounding);
}

// The two masses m of a chain wall–k–m–k–m have ω² = k/m (3 ∓ √5)/2.
TEST(Eigenvalues, ChainOfTwoMassesHasItsTextbookFrequencies) {
  const double k = 800.0, m = 2.5;
  Eigen::MatrixXd K(2, 2);
  K << 2.0 * k, -k, -k, k;
  const Eigen::VectorXd squares = generalized_eigenvalues(K, m * Eigen::MatrixXd::Identity(2, 2));
  EXPECT_NEAR(squares[0], k / m * (3.0 - std::sqrt(5.0)) / 2.0, 1e3 * rounding);
  EXPECT_NEAR(squares[1], k / m * (3.0 + std::sqrt(5.0)) / 2.0, 1e3 * rounding);
}

// The same chain, without masses; and one row, which has nothing to be made tridiagonal.
TEST(Eigenvalues, OfASmallSymmetricMatrix) {
  SmallMatrix A(2, 2);
  A << 2.0, -1.0, -1.0, 1.0;
  const SmallVector values = symmetric_eigenvalues(A);
  EXPECT_NEAR(values[0], (3.0 - std::sqrt(5.0)) / 2.0, rounding);
  EXPECT_NEAR(values[1], (3.0 + std::sqrt(5.0)) / 2.0, rounding);
  EXPECT_EQ(symmetric_eigenvalues(SmallMatrix::Constant(1, 1, -3.0))[0], -3.0);
  EXPECT_EQ(symmetric_eigenvalues(SmallMatrix::Zero(3, 3)).norm(), 0.0);
}

TEST(Eigenvalues, AndVectorsMakeTheMatrixAgain) {
  Mat6 A = Mat6::Constant(0.25);
  A.diagonal() << 1.0, 2.0, 3.0, 4.0, 5.0, 6.0;
  const SymmetricEigen eigen = symmetric_eigen(A);
  EXPECT_LT((eigen.vectors * eigen.values.asDiagonal() * eigen.vectors.transpose() - A).norm(), 10.0 * rounding);
}

TEST(Eigenvalues, TheSmallestSingularValueOfThreeRows) {
  Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::ColMajor, 3, most_rows> A(3, 4);
  A << 3.0, 0.0, 0.0, 4.0,  //
      0.0, 2.0, 0.0, 0.0,   //
      0.0, 0.0, -7.0, 0.0;
  EXPECT_NEAR(smallest_singular_value(A), 2.0, rounding);
  A.row(1) = A.row(0);
  EXPECT_NEAR(smallest_singular_value(A), 0.0, 1e-7);
}

}  // namespace
}  // namespace proxarm::models
