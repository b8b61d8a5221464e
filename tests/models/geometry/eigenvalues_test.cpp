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

}  // namespace
}  // namespace proxarm::models
