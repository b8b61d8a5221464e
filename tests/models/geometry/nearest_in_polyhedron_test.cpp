// The quadratic program of the arm's step, against all choices of active rows.
#include "models/geometry/nearest_in_polyhedron.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>
#include <optional>
#include <vector>

#include "tests/models/surfaces/random_states.hpp"

namespace proxarm::models {
namespace {

using tests::Random;
using tests::scaled;

struct Program {
  Eigen::MatrixXd H;
  Eigen::VectorXd g;
  std::vector<Eigen::VectorXd> equal, rows;
  std::vector<double> values, bounds;
};

double cost(const Program& p, const Eigen::VectorXd& u) { return 0.5 * u.dot(p.H * u) - p.g.dot(u); }

bool within(const Program& p, const Eigen::VectorXd& u, double tolerance) {
  for (std::size_t i = 0; i < p.rows.size(); ++i) {
    if (p.rows[i].dot(u) > p.bounds[i] + tolerance) return false;
  }
  for (std::size_t i = 0; i < p.equal.size(); ++i) {
    if (std::abs(p.equal[i].dot(u) - p.values[i]) > tolerance) return false;
  }
  return true;
}

// The optimum by Lagrange's equations for every subset of rows as equations: the cheapest that keeps all rows.
std::optional<Eigen::VectorXd> by_all_subsets(const Program& p) {
  const auto n = p.g.size();
  const auto e = static_cast<Eigen::Index>(p.equal.size());
  std::optional<Eigen::VectorXd> best;
  for (unsigned choice = 0; choice < 1u << p.rows.size(); ++choice) {
    std::vector<std::size_t> active;
    for (std::size_t i = 0; i < p.rows.size(); ++i) {
      if ((choice & 1u << i) != 0) active.push_back(i);
    }
    const auto m = e + static_cast<Eigen::Index>(active.size());
    if (m > n) continue;
    Eigen::MatrixXd A = Eigen::MatrixXd::Zero(n + m, n + m);
    Eigen::VectorXd b = Eigen::VectorXd::Zero(n + m);
    A.topLeftCorner(n, n) = p.H;
    b.head(n) = p.g;
    for (Eigen::Index k = 0; k < m; ++k) {
      const bool equation = k < e;
      const auto i = equation ? static_cast<std::size_t>(k) : active[static_cast<std::size_t>(k - e)];
      const Eigen::VectorXd& row = equation ? p.equal[i] : p.rows[i];
      A.block(n + k, 0, 1, n) = row.transpose();
      A.block(0, n + k, n, 1) = row;
      b[n + k] = equation ? p.values[i] : p.bounds[i];
    }
    const Eigen::FullPivLU<Eigen::MatrixXd> lu(A);
    if (!lu.isInvertible()) continue;
    const Eigen::VectorXd u = lu.solve(b).head(n);
    if (within(p, u, 1e-9) && (!best || cost(p, u) < cost(p, *best))) best = u;
  }
  return best;
}

NearestInPolyhedron prepared(const Program& p) {
  NearestInPolyhedron out;
  out.start(SmallMatrix(p.H), SmallVector(p.g));
  for (std::size_t i = 0; i < p.equal.size(); ++i) out.equal(SmallVector(p.equal[i]), p.values[i]);
  for (std::size_t i = 0; i < p.rows.size(); ++i) out.at_most(SmallVector(p.rows[i]), p.bounds[i]);
  return out;
}

Eigen::VectorXd random_vector(Random& random, Eigen::Index n) {
  Eigen::VectorXd v(n);
  for (double& x : v) x = random.uniform(-1.0, 1.0);
  return v;
}

Program random_program(Random& random) {
  Program p;
  const auto n = static_cast<Eigen::Index>(random.uniform(1.0, 8.99));
  const Eigen::MatrixXd B = Eigen::MatrixXd::NullaryExpr(n, n, [&] { return random.uniform(-1.0, 1.0); });
  p.H = B.transpose() * B + random.log_uniform(1e-3, 1.0) * Eigen::MatrixXd::Identity(n, n);
  p.g = 3.0 * random_vector(random, n);
  const auto equations = static_cast<int>(random.uniform(0.0, std::min<double>(3.0, static_cast<double>(n) - 0.01)));
  for (int i = 0; i < equations; ++i) {
    p.equal.push_back(random_vector(random, n));
    p.values.push_back(random.uniform(-0.3, 0.3));
  }
  const auto rows = static_cast<int>(random.uniform(0.0, 10.99));
  for (int i = 0; i < rows; ++i) {
    p.rows.push_back(random_vector(random, n));
    p.bounds.push_back(random.uniform(-0.5, 1.0));
  }
  return p;
}

// 1e-7: H has a condition of up to 1e4 here, and its square of multipliers.
TEST(NearestInPolyhedron, FindsTheCheapestPointThatKeepsAllRows) {
  Random random(51);
  int feasible = 0, not_feasible = 0;
  for (std::int64_t k = 0; k < scaled(3000); ++k) {
    const Program p = random_program(random);
    const auto best = by_all_subsets(p);
    NearestInPolyhedron program = prepared(p);
    const bool found = program.solve();
    ASSERT_EQ(found, best.has_value()) << k;
    ++(found ? feasible : not_feasible);
    if (!found) continue;
    ASSERT_TRUE(within(p, program.u(), 1e-10)) << k;
    ASSERT_LT((Eigen::VectorXd(program.u()) - *best).norm(), 1e-7) << k;
    // H u − g + Σ λ a = 0, with λ ≥ 0 of inequalities.
    Eigen::VectorXd rest = p.H * Eigen::VectorXd(program.u()) - p.g;
    for (std::size_t i = 0; i < p.equal.size(); ++i) rest += program.multiplier(i) * p.equal[i];
    for (std::size_t i = 0; i < p.rows.size(); ++i) {
      ASSERT_GE(program.multiplier(p.equal.size() + i), 0.0) << k;
      rest += program.multiplier(p.equal.size() + i) * p.rows[i];
    }
    ASSERT_LT(rest.norm(), 1e-8) << k;
  }
  EXPECT_GT(feasible, scaled(1000));
  EXPECT_GT(not_feasible, scaled(100));
}

TEST(NearestInPolyhedron, KeepsABoxAsItKeepsItsRowsToTheBit) {
  Random random(53);
  int feasible = 0;
  for (std::int64_t k = 0; k < scaled(3000); ++k) {
    Program p = random_program(random);
    const auto n = p.g.size();
    const Eigen::VectorXd low = -0.5 * random_vector(random, n).cwiseAbs(), high = random_vector(random, n).cwiseAbs();
    NearestInPolyhedron boxed = prepared(p);
    boxed.within(SmallVector(low), SmallVector(high));
    for (Eigen::Index i = 0; i < n; ++i) {
      p.rows.emplace_back(Eigen::VectorXd::Unit(n, i));
      p.bounds.push_back(high[i]);
      p.rows.emplace_back(-Eigen::VectorXd::Unit(n, i));
      p.bounds.push_back(-low[i]);
    }
    NearestInPolyhedron by_rows = prepared(p);
    ASSERT_EQ(boxed.rows(), by_rows.rows());
    ASSERT_EQ(boxed.solve(), by_rows.solve()) << k;
    ASSERT_EQ(boxed.u(), by_rows.u()) << k;
    for (std::size_t i = 0; i < boxed.rows(); ++i) ASSERT_EQ(boxed.multiplier(i), by_rows.multiplier(i)) << k;
    if (!boxed.solve()) continue;
    ++feasible;
    ASSERT_TRUE((boxed.u().array() <= high.array() + 1e-12).all() && (boxed.u().array() >= low.array() - 1e-12).all());
  }
  EXPECT_GT(feasible, scaled(500));
}

TEST(NearestInPolyhedron, KeepsRowsThatRepeatOrContradictEachOther) {
  Program p{Eigen::MatrixXd::Identity(3, 3), Eigen::Vector3d(1.0, 2.0, 3.0), {}, {}, {}, {}};
  for (int i = 0; i < 5; ++i) {
    p.rows.emplace_back(Eigen::Vector3d::UnitZ());
    p.bounds.push_back(1.0);
  }
  NearestInPolyhedron twice = prepared(p);
  ASSERT_TRUE(twice.solve());
  EXPECT_LT((Eigen::Vector3d(twice.u()) - Eigen::Vector3d(1.0, 2.0, 1.0)).norm(), 1e-14);
  p.rows.emplace_back(-Eigen::Vector3d::UnitZ());
  p.bounds.push_back(-1.0 - 1e-6);
  EXPECT_FALSE(prepared(p).solve());
  p.bounds.back() = -1.0;
  NearestInPolyhedron touching = prepared(p);
  ASSERT_TRUE(touching.solve());
  EXPECT_NEAR(touching.u()[2], 1.0, 1e-14);
}

// The story: rows that differed in their tenth digit lost the program's digits, and a corner of the box was taken for a
// solution; the arm jumped by 2 mm.
TEST(NearestInPolyhedron, NeverTakesForASolutionWhatLeavesARow) {
  Random random(52);
  int solved = 0;
  for (std::int64_t k = 0; k < scaled(3000); ++k) {
    Program p = random_program(random);
    p.H *= random.log_uniform(1e-7, 1.0);
    const std::size_t different = p.rows.size();
    for (std::size_t i = 0; i < different; ++i) {
      for (int copy = 0; copy < 3; ++copy) {
        const double apart = random.log_uniform(1e-14, 1e-4);
        p.rows.emplace_back(p.rows[i] + apart * random_vector(random, p.g.size()));
        p.bounds.push_back(p.bounds[i] + apart * random.uniform(-1.0, 1.0));
      }
    }
    NearestInPolyhedron program = prepared(p);
    if (!program.solve()) continue;
    ++solved;
    // Relative to what is multiplied in a row: u, and the point u0 that the program begins at.
    const double size = 1.0 + program.u().norm() + p.H.ldlt().solve(p.g).norm();
    ASSERT_TRUE(within(p, program.u(), 1e-5 * size)) << k;
  }
  EXPECT_GT(solved, scaled(500));
}

TEST(NearestInPolyhedron, LeavesAPointThatKeepsAllRowsWhereItIs) {
  Program p{
      2.0 * Eigen::MatrixXd::Identity(2, 2), Eigen::Vector2d(1.0, -1.0), {}, {Eigen::Vector2d(1.0, 1.0)}, {}, {0.1}};
  NearestInPolyhedron program = prepared(p);
  ASSERT_TRUE(program.solve());
  EXPECT_DOUBLE_EQ(program.u()[0], 0.5);
  EXPECT_DOUBLE_EQ(program.u()[1], -0.5);
  EXPECT_EQ(program.multiplier(0), 0.0);
}

}  // namespace
}  // namespace proxarm::models
