#include "models/local_problem/contact_problem.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "tests/models/local_problem/local_problem.hpp"

namespace proxarm::models {
namespace {

TEST(ContactProblem, KeepsTheLawForAFewContactsAndAnyStiffness) {
  Random random(5);
  ContactProblem problem;
  int unsolved = 0;
  const int cases = 4000;
  for (int i = 0; i < cases; ++i) {
    const Mat6 K = random_stiffness(random, random.log_uniform(1.0, 1e6));
    problem.set_stiffness(K);
    const Twist before = random_twist(random), e = random_twist(random);
    std::vector<LinearContact> contacts = random_contacts(random, 1 + random.below(4), before, 0.6);
    Twist delta;
    if (!problem.solve(e, contacts, delta)) {
      ++unsolved;
      continue;
    }
    EXPECT_LE(violation(K, e, contacts, delta), 1e-9) << "case " << i;
  }
  EXPECT_LE(unsolved, cases / 200);
}

TEST(ContactProblem, ASolutionOfOneStiffnessIsOneOfAll) {
  // Assumption 1: e' = K'⁻¹ K (e + δ) − δ leaves forces and δ as they are.
  Random random(6);
  ContactProblem problem;
  int judged = 0, moved = 0;
  for (int i = 0; i < 2000; ++i) {
    const Mat6 K = random_stiffness(random, 100.0), other = random_stiffness(random, random.log_uniform(1.0, 1e6));
    const Twist before = random_twist(random), e = random_twist(random);
    std::vector<LinearContact> contacts = random_contacts(random, 1 + random.below(3), before, 0.4);
    Twist delta, again;
    problem.set_stiffness(K);
    if (!problem.solve(e, contacts, delta)) continue;
    problem.set_stiffness(other);
    const Twist e_other = other.ldlt().solve(K * (e + delta)) - delta;
    if (problem.count_solutions(e_other, contacts) != 1) continue;
    for (LinearContact& contact : contacts) contact.f.setZero();
    if (!problem.solve(e_other, contacts, again)) continue;
    ++judged;
    moved += (again - delta).norm() > 1e-8 * (1.0 + e_other.norm()) ? 1 : 0;
  }
  EXPECT_GT(judged, 1800);
  EXPECT_EQ(moved, 0);
}

TEST(ContactProblem, WithoutFrictionContactsThatNearlyDependOnEachOtherAreHeld) {
  // Up to eight, of which each but the first two is next to a mixture of those: a thing that rests on a corner of many
  // edges. What is looked for exists (δ = before keeps all gaps), and is held to what a gap may be short
  // of.
  Random random(8);
  ContactProblem problem;
  for (int i = 0; i < 3000; ++i) {
    const Mat6 K = 1e6 * random_stiffness(random, 100.0);
    problem.set_stiffness(K);
    std::vector<LinearContact> contacts(3U + static_cast<std::size_t>(random.below(6)));
    const double apart = random.log_uniform(1e-12, 1e-2);
    for (std::size_t k = 0; k < contacts.size(); ++k) {
      contacts[k].J.setZero();
      contacts[k].J.row(0) = k < 2 ? random_twist(random).transpose()
                                   : Eigen::RowVector<double, 6>(random.uniform(0.1, 1.0) * contacts[0].J.row(0) +
                                                                 random.uniform(0.1, 1.0) * contacts[1].J.row(0) +
                                                                 apart * random_twist(random).transpose());
      contacts[k].c[0] = random.chance(0.5) ? 0.0 : random.uniform(0.0, 1e-14);
    }
    const Twist e = 1e-3 * random_twist(random);
    Twist delta;
    ASSERT_TRUE(problem.solve(e, contacts, delta)) << "case " << i;
    Twist sum = Twist::Zero();
    double most = 0.0;
    for (const LinearContact& contact : contacts) {
      const double gap = contact.c[0] + contact.J.row(0).dot(delta);
      EXPECT_GE(gap, -1e-12) << "case " << i;
      EXPECT_GE(contact.f[0], 0.0) << "case " << i;
      sum += contact.J.row(0).transpose() * contact.f[0];
      most = std::max(most, contact.f[0]);
    }
    const Twist wrench = K * (e + delta);
    // The solver's tolerance is one of its unknowns, Lᵀδ; and forces that are far greater than their sum round it.
    const Eigen::LLT<Mat6> factors(K);
    const Twist lack = factors.matrixL().solve(sum - wrench), free = factors.matrixU() * e;
    const double rounded = 1e-13 * most * factors.matrixL().solve(Mat6::Identity()).norm();
    EXPECT_LE(lack.norm(), 2e-10 * free.norm() + rounded) << "case " << i;
  }
}

TEST(ContactProblem, SeveralSolutionsOfPainlevesRodAreCounted) {
  // Painlevé's rod: one contact, a lever that makes friction press it on. μ beyond the limit leaves free and stuck.
  LinearContact contact;
  const Vec3 lever(-0.2, 0.0, -0.4);
  int row = 0;
  for (const Vec3& axis : {Vec3(0.0, 0.0, 1.0), Vec3(1.0, 0.0, 0.0), Vec3(0.0, 1.0, 0.0)}) {
    contact.J.row(row).head<3>() = axis;
    contact.J.row(row++).tail<3>() = lever.cross(axis);
  }
  contact.mu = 3.0;
  ContactProblem problem;
  Vec<6> K;
  K << 1.0, 1.0, 1.0, 0.01, 0.01, 0.01;
  problem.set_stiffness(K.asDiagonal());
  Twist e = Twist::Zero();
  e[0] = 0.1;
  // Free, it would be 1 mm over the surface and have slid by 0.3 m towards where friction lifts the lever: f_n then
  // takes u_n down by (μ 8 − 5) f_n, until it touches. So it may fly, slide or stick.
  contact.c << contact.J.row(0).dot(e) + 0.001, contact.J.row(1).dot(e) - 0.3, contact.J.row(2).dot(e);
  EXPECT_GT(problem.count_solutions(e, {&contact, 1}), 1);
  contact.mu = 0.5;  // below 5/8 there is one
  EXPECT_EQ(problem.count_solutions(e, {&contact, 1}), 1);
}

}  // namespace
}  // namespace proxarm::models
