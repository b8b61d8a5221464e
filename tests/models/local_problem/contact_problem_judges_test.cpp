// The local problem against solvers that share no code with it: all combinations of contact states in long double, and
// the Siconos library. Counts at scale 1; PROXARM_TEST_SCALE=17 makes them 1,700, 10,200 and 2,550 (of conditions up to
// a million), as does .ci/nightly property twice.
#include <gtest/gtest.h>

#include <iostream>

#include "tests/models/local_problem/brute_force.hpp"
#include "tests/models/local_problem/local_problem.hpp"
#include "tests/models/local_problem/siconos_judge.hpp"
#include "tests/models/surfaces/random_states.hpp"

namespace proxarm::models {
namespace {

TEST(ContactProblem, FindsASolutionWheneverBruteForceDoesAndTheSame) {
  const std::int64_t cases = tests::scaled(100);
  tests::Random random(21);
  ContactProblem problem;
  int several = 0, none = 0, missed = 0, brute_missed = 0;
  double worst = 0.0;
  for (std::int64_t i = 0; i < cases; ++i) {
    const Mat6 K = random_stiffness(random, random.log_uniform(1.0, 100.0));
    const Twist before = random_twist(random), e = random_twist(random);
    std::vector<LinearContact> contacts = random_contacts(random, 1 + random.below(3), before, 2.0);
    problem.set_stiffness(K);
    Twist delta;
    const bool solved = problem.solve(e, contacts, delta);
    const BruteForce brute(K, e, contacts);
    several += brute.solutions().size() > 1 ? 1 : 0;
    if (!solved) {
      ++(brute.solutions().empty() ? none : missed);
    } else if (brute.distance(K, e, delta) > 1e-9) {
      // Newton's method from some directions doesn't meet each solution. Then the law itself judges.
      ++brute_missed;
      EXPECT_LE(violation(K, e, contacts, delta), 1e-11) << "case " << i;
    } else {
      worst = std::max(worst, brute.distance(K, e, delta));
    }
  }
  std::cout << "  " << cases << " problems, " << several << " with several solutions, " << none << " with none, "
            << missed << " missed, " << brute_missed << " that only we solved; off by " << worst << " at most\n";
  EXPECT_EQ(missed, 0);
  EXPECT_LE(brute_missed, cases / 100) << "or else the judge is blind";
}

// With stiffnesses up to a condition. The law is met to 1e-10 in the norms of K, up to √condition less in those of
// force and way (2.5e-9 in 2,550 problems up to a million); and Siconos comes to its end of fewer.
struct Siconos {
  double condition, law, least_judged;
};
void agree_with_siconos(std::int64_t cases, std::uint64_t seed, const Siconos& bounds) {
  tests::Random random(seed);
  ContactProblem problem;
  int judged = 0, loose = 0, other = 0, unsolved = 0, unsolved_by_both = 0, only_ours = 0;
  double worst = 0.0;
  for (std::int64_t i = 0; i < cases; ++i) {
    const Mat6 K = random_stiffness(random, random.log_uniform(1.0, bounds.condition));
    const Twist before = random_twist(random), e = random_twist(random);
    std::vector<LinearContact> contacts = random_contacts(random, 1 + random.below(12), before, 0.8);
    std::vector<LinearContact> theirs = contacts;
    problem.set_stiffness(K);
    Twist delta, their_delta;
    const bool ours_solved = problem.solve(e, contacts, delta);
    const bool theirs_solved =
        solve_by_siconos(K, e, theirs, their_delta) && violation(K, e, theirs, their_delta) <= 1e-9;
    if (ours_solved) {
      EXPECT_LE(violation(K, e, contacts, delta), bounds.law) << "case " << i;
    }
    if (!ours_solved) ++(theirs_solved ? unsolved : unsolved_by_both);
    if (ours_solved && !theirs_solved) ++only_ours;
    if (!ours_solved || !theirs_solved) continue;
    const double apart = (delta - their_delta).norm() / e.norm();
    // Two solutions that both keep the law lie apart: Coulomb's law allows several.
    if (apart > 1e-6) {
      ++other;
    } else {
      ++judged;
      loose += apart > 1e-9 ? 1 : 0;
      worst = std::max(worst, apart);
    }
  }
  std::cout << "  " << cases << " problems: " << judged << " alike, off by " << worst << " at most, " << loose
            << " of them by more than 1e-9; " << other << " where another solution was found; unsolved by us "
            << unsolved << ", by Siconos " << only_ours << ", by both " << unsolved_by_both << "\n";
  // Where contacts hold each other the law is met to 1e-10 only, and δ to some hundred times that.
  EXPECT_LE(worst, 1e-8);
  EXPECT_LE(loose, cases / 1000);
  EXPECT_GE(static_cast<double>(judged), bounds.least_judged * static_cast<double>(cases))
      << "or else this looks at nothing";
  EXPECT_LE(unsolved, 1 + cases / 1000);
}

TEST(ContactProblem, AgreesWithSiconosOnUpToTwelveContacts) {
  if (!siconos_is_there()) GTEST_SKIP() << "built without libsiconos-numerics-dev";
  agree_with_siconos(tests::scaled(600), 22, {.condition = 100.0, .law = 1e-10, .least_judged = 0.9});
}

TEST(ContactProblem, AgreesWithSiconosAtConditionsUpToAMillion) {
  if (!siconos_is_there()) GTEST_SKIP() << "built without libsiconos-numerics-dev";
  agree_with_siconos(tests::scaled(150, 150), 24, {.condition = 1e6, .law = 1e-7, .least_judged = 0.75});
}

}  // namespace
}  // namespace proxarm::models
