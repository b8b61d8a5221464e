#include "models/arm/prioritized_step.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>

#include "tests/allocation_count.hpp"
#include "tests/models/surfaces/random_states.hpp"

namespace proxarm::models {
namespace {

using tests::Random;

struct Problem {
  JointMatrix A, H;
  SmallVector e;
  JointVector g;
};

Problem random_problem(Random& random, int rows, int axes) {
  const auto matrix = [&](int n, int m) {
    JointMatrix out(n, m);
    for (int i = 0; i < n; ++i) {
      for (int k = 0; k < m; ++k) out(i, k) = random.uniform(-1.0, 1.0);
    }
    return out;
  };
  Problem p{matrix(rows, axes), {}, matrix(rows, 1).col(0), matrix(axes, 1).col(0)};
  const JointMatrix half = matrix(axes, axes);
  p.H = half.lazyProduct(half.transpose());
  p.H.diagonal().array() += 1.0;
  return p;
}

// The problem's own optimality conditions, H δ − Aᵀν = g and A δ = e, as one system with full pivoting.
TEST(PrioritizedStep, SolvesTheOptimalityConditions) {
  Random random(401);
  for (int n = 0; n < 2000; ++n) {
    const int axes = static_cast<int>(random.uniform(1.0, 8.0)), rows = std::min(6, 1 + n % axes);
    const Problem p = random_problem(random, rows, axes);
    Eigen::MatrixXd K = Eigen::MatrixXd::Zero(axes + rows, axes + rows);
    K.topLeftCorner(axes, axes) = p.H;
    K.topRightCorner(axes, rows) = -p.A.transpose();
    K.bottomLeftCorner(rows, axes) = p.A;
    Eigen::VectorXd b(axes + rows);
    b << p.g, p.e;
    const Eigen::FullPivLU<Eigen::MatrixXd> lu(K);
    const Eigen::VectorXd wanted = lu.solve(b).head(axes);
    const PrioritizedStep step = prioritized_step(p.A, p.e, p.H, p.g);
    // Errors grow with the condition of A, of which a random one may be as bad as 1e4.
    const double scale = 1e-9 * (1.0 + wanted.norm());
    ASSERT_LT((step.task + step.rest - wanted).norm(), scale) << axes << " axes, " << rows << " rows";
    ASSERT_LT((p.A * step.task - p.e).norm(), scale);
    ASSERT_LT((p.A * step.rest).norm(), scale);
  }
}

TEST(PrioritizedStep, TurnsTheToolAsLittleAsTheTaskAllows) {
  // Two parallel axes, 1 m and 0.5 m from T, and one at T: the last turns back what the others turn.
  Jacobian J = Jacobian::Zero(6, 3);
  J.row(1) << 1.0, 0.5, 0.0;
  J.row(0) << 0.0, 0.3, 0.0;
  J.row(5) << 1.0, 1.0, 1.0;
  const JointMatrix A = J.topRows<2>();
  const SmallVector e = Eigen::Vector2d(0.01, 0.02);
  const PrioritizedStep step = prioritized_step(A, e, turning_cost(J), JointVector::Zero(3));
  EXPECT_NEAR((J.topRows<2>() * step.task - e).norm(), 0.0, 1e-15);
  // E in H is worth 1/turning_weight of it.
  EXPECT_LT(std::abs(step.task.sum()), 0.02 * step.task.cwiseAbs().sum());
}

TEST(PrioritizedStep, TakesNothingFromTheHeap) {
  if (!tests::allocations_are_counted()) GTEST_SKIP() << "a sanitizer's malloc can't be counted";
  Random random(402);
  double sum = 0.0;
  for (int axes = 1; axes <= max_axes; ++axes) {
    const Problem p = random_problem(random, std::min(6, axes), axes);
    const std::uint64_t before = tests::allocation_count();
    sum += prioritized_step(p.A, p.e, p.H, p.g).task.sum();
    ASSERT_EQ(tests::allocation_count(), before) << axes << " axes";
  }
  EXPECT_TRUE(std::isfinite(sum));
}

}  // namespace
}  // namespace proxarm::models
