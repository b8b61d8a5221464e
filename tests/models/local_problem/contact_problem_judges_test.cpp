// The local problem against solvers that share no code with it: all combinations of contact states in long double, and
// the Siconos library. Counts at scale 1; PROXARM_TEST_SCALE=17 makes them 1,700, 10,200 and 2,550 (of conditions up to a
// million), as does .ci/nightly property twice.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <iostream>
#include <numeric>

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

// With stiffnesses up to a condition. The law is met to 1e-10 in the norms of K, which is less in those of force and
// way; and Siconos comes to its end of fewer problems.
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
  EXPECT_GE(static_cast<double>(judged), bounds.least_judged * static_cast<double>(cases)) << "or else this looks at nothing";
  EXPECT_LE(unsolved, 1 + cases / 1000);
}

TEST(ContactProblem, AgreesWithSiconosOnUpToTwelveContacts) {
  if (!siconos_is_there()) GTEST_SKIP() << "built without libsiconos-numerics-dev";
  agree_with_siconos(tests::scaled(600), 22, {.condition = 100.0, .law = 1e-10, .least_judged = 0.9});
}

TEST(ContactProblem, AgreesWithSiconosAtConditionsUpToAMillion) {
  if (!siconos_is_there()) GTEST_SKIP() << "built without libsiconos-numerics-dev";
  agree_with_siconos(tests::scaled(150), 24, {.condition = 1e6, .law = 1e-9, .least_judged = 0.75});
}

// Without friction the law is that of the projection onto the gaps' polyhedron, in K: of seven contacts or more the shares
// of the wrench may be many, and the wrench is one, whatever is guessed and whichever contact comes first.
TEST(ContactProblem, TheWrenchOfManyContactsWithoutFrictionIsOneWhateverTheirOrderAndGuess) {
  const std::int64_t cases = tests::scaled(2000);
  tests::Random random(23);
  ContactProblem problem;
  int unsolved = 0, several = 0, pressed = 0, over = 0;
  double wrench_off = 0.0, way_off = 0.0;
  for (std::int64_t i = 0; i < cases; ++i) {
    const Mat6 K = random_stiffness(random, random.log_uniform(1.0, 1e4));
    const Twist before = random_twist(random), e = random_twist(random);
    std::vector<LinearContact> contacts = random_contacts(random, 7 + random.below(6), before, 0.0);
    // Some stand twice, and some at mixtures of others' places: what rests on a face, whose shares are many.
    for (std::size_t k = 3; k < contacts.size(); k += 3) {
      contacts[k].J = 0.5 * (contacts[k - 1].J + contacts[k - 2].J);
      contacts[k].c = 0.5 * (contacts[k - 1].c + contacts[k - 2].c);
    }
    problem.set_stiffness(K);
    Twist first_wrench, first_delta;
    std::vector<double> first_shares;
    for (int again = 0; again < 4; ++again) {
      std::vector<std::size_t> order(contacts.size());
      std::iota(order.begin(), order.end(), 0U);
      for (std::size_t k = order.size(); again > 0 && k > 1; --k) {
        std::swap(order[k - 1], order[static_cast<std::size_t>(random.below(static_cast<int>(k)))]);
      }
      std::vector<LinearContact> put;
      for (const std::size_t k : order) {
        put.push_back(contacts[k]);
        put.back().mu = 0.0;
        put.back().f[0] = again < 2 ? 0.0 : random.uniform(0.0, 5.0);
      }
      Twist delta;
      if (!problem.solve(e, put, delta)) {
        ++unsolved;
        continue;
      }
      Twist wrench = Twist::Zero();
      std::vector<double> shares(contacts.size());
      for (std::size_t k = 0; k < put.size(); ++k) {
        wrench += put[k].J.transpose() * put[k].f;
        shares[order[k]] = put[k].f[0];
      }
      if (again == 0) {
        first_wrench = wrench;
        first_delta = delta;
        first_shares = shares;
        pressed += wrench.norm() > 0.0 ? 1 : 0;
        continue;
      }
      // In the norms of K, whose eigenvalues are 1 to 1e4: the free motion's press is 1.
      const Eigen::LLT<Mat6> factors(K);
      const double press = (factors.matrixU() * e).norm();
      const double off = factors.matrixL().solve(wrench - first_wrench).norm() / press;
      over += off > 1e-10 ? 1 : 0;
      wrench_off = std::max(wrench_off, off);
      way_off = std::max(way_off, (factors.matrixU() * (delta - first_delta)).norm() / press);
      double apart = 0.0;
      for (std::size_t k = 0; k < shares.size(); ++k) apart = std::max(apart, std::abs(shares[k] - first_shares[k]));
      several += apart > 1e-6 * first_wrench.norm() ? 1 : 0;
    }
  }
  std::cout << "  " << cases << " problems, " << pressed << " pressed; wrenches apart by " << wrench_off << ", ways by "
            << way_off << " (" << over << " beyond 1e-10); " << several << " with other shares, " << unsolved << " unsolved\n";
  // Each is solved to 1e-10 of the free motion's press, and two of them are twice that apart at most.
  EXPECT_LE(wrench_off, 2e-10);
  EXPECT_LE(way_off, 2e-10);
  EXPECT_LE(over, 1 + cases / 500) << "beyond 1e-10";
  EXPECT_EQ(unsolved, 0);
  EXPECT_GT(pressed, cases / 2);
  EXPECT_GT(several, 0) << "or else nothing was to be told apart";
}

}  // namespace
}  // namespace proxarm::models
