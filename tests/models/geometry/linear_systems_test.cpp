#include "models/geometry/linear_systems.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "tests/models/surfaces/random_states.hpp"

namespace proxarm::models {
namespace {

// Solutions of well conditioned systems of this size are exact to some ε times their norm.
constexpr double rounding = 1e-13;

// Diagonally dominant, so that it is regular; symmetric and positive definite if asked for.
Equations dominant(Eigen::Index n, bool symmetric) {
  Equations A(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < n; ++j) {
      const auto a = static_cast<double>((7 * i + 3 * j + 2) % 5), b = static_cast<double>((7 * j + 3 * i + 2) % 5);
      A(i, j) = (symmetric ? a + b : a) + (i == j ? 12.0 * static_cast<double>(n) : 0.0);
    }
  }
  return A;
}

TEST(LinearSystems, CholeskySolvesSixAndAnyFewerRows) {
  const Mat6 A = dominant(6, true);
  const Eigen::Matrix<double, 6, 3> B = dominant(6, false).leftCols<3>();
  EXPECT_LT((A * solve_positive_definite(A, B) - B).norm(), rounding * B.norm());
  const SmallMatrix small = dominant(4, true);
  const SmallColumns3 right = dominant(4, false).leftCols<3>();
  EXPECT_LT((small.lazyProduct(solve_positive_definite(small, right)) - right).norm(), rounding * right.norm());
}

TEST(LinearSystems, FactorsSolveAndInvert) {
  const Mat6 A = dominant(6, false);
  const Vec<6> b = Vec<6>::LinSpaced(1.0, 6.0);
  FactoredMatrix factored;
  factored.factor(A);
  EXPECT_LT((A * factored.solve(b) - b).norm(), rounding * b.norm());
  EXPECT_LT((A * factored.inverse() - Mat6::Identity()).norm(), rounding);
  EXPECT_EQ(solve_square<6>(A, b), factored.solve(b));
  const Eigen::Matrix<double, 9, 9> nine = dominant(9, false);
  const Vec<9> ones = Vec<9>::Ones();
  EXPECT_LT((nine * solve_square<9>(nine, ones) - ones).norm(), rounding * ones.norm());
}

// So that whoever counts on the old bits of a session gets them.
TEST(LinearSystems, FactorsAreEigensToTheBit) {
  tests::Random random(7);
  for (int run = 0; run < 1000; ++run) {
    Mat6 A;
    for (double& a : A.reshaped()) a = random.chance(0.1) ? 0.0 : random.uniform(-1.0, 1.0);
    if (random.chance(0.1)) A.row(3) = 2.0 * A.row(1);
    const Vec<6> b = A.col(0) + Vec<6>::Ones();
    FactoredMatrix factored;
    factored.factor(A);
    const Eigen::PartialPivLU<Mat6> theirs(A);
    const Vec<6> ours = factored.solve(b), expected = theirs.solve(b);
    if (!expected.allFinite()) {
      EXPECT_FALSE(ours.allFinite()) << run;
      continue;
    }
    ASSERT_EQ(ours, expected) << run;
    ASSERT_EQ(factored.inverse(), Mat6(theirs.inverse())) << run;
  }
}

TEST(LinearSystems, OnlyARegularMatrixHasAnInverse) {
  Mat6 A = dominant(6, false);
  const std::optional<Mat6> inverse = inverse_if_regular(A);
  ASSERT_TRUE(inverse);
  EXPECT_LT((A * *inverse - Mat6::Identity()).norm(), rounding);
  A.row(4) = 2.0 * A.row(1);
  EXPECT_FALSE(inverse_if_regular(A));
  EXPECT_FALSE(inverse_if_regular(Mat6::Zero()));
}

// Two contacts that bear the same load: whoever bears how much, their sum is right.
TEST(LinearSystems, LeastSquaresSolveWhatIsSingularButConsistent) {
  Equations A = dominant(12, false);
  A.row(7) = A.row(2);
  Unknowns b = A * Unknowns::Ones(12);
  EXPECT_LT((A * solve_least_squares(A, b) - b).norm(), rounding * b.norm());
  A.setZero();
  b.setZero();
  EXPECT_EQ(solve_least_squares(A, b), Unknowns::Zero(12));
}

}  // namespace
}  // namespace proxarm::models
