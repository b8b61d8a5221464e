#include "controller/extras/studies/error/error_plot.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace proxarm::studies {
namespace {

// Runs with steps of 4, 2 and 1 ms whose error is `error_1_m` at 1 ms and falls by `order`; a step takes `step_ns`.
Runs runs(const char* method, double error_1_m, double order, double step_ns) {
  Runs made{.method = method};
  for (const double T : {4e-3, 2e-3, 1e-3}) {
    const double error = error_1_m * std::pow(T / 1e-3, order);
    made.T.push_back(T);
    made.steps.push_back(1.0 / T);
    made.error.push_back({error, error, error});
    made.cost_ns.push_back(step_ns / T);
  }
  return made;
}

std::vector<Runs> motion(double order_2_error_m, double euler_error_m) {
  return {runs("1", 3e-5, 2.0, 30.0),
          runs("2", order_2_error_m, 2.0, 40.0),
          runs("penalty_euler", euler_error_m, 2.0, 20.0),
          runs("penalty_rk4", 9e-4, 2.0, 90.0),
          runs("penalty_implicit", 8e-4, 2.0, 95.0),
          runs("ros", 9e-4, 2.0, 30.0)};
}

TEST(ErrorAnswer, CountsTheMotionsInWhichOrder2IsFaster) {
  EXPECT_EQ(work_answer({{"impact", motion(1e-6, 1.4e-4)}, {"pendulum", motion(1e-4, 1e-5)}}),
            "For the same error order 2 takes less time than the best of the others, tuned to the motion, in 1 of 2 "
            "motions");
}

TEST(ErrorAnswer, NamesThePenaltyMethodThatErrsLeastWhereItErrsMost) {
  EXPECT_EQ(glance_answer({{"impact", motion(1e-6, 1.43e-4)}, {"pendulum", motion(1.05e-5, 1e-5)}}),
            "At 1 ms order 2 errs by at most 10.5 µm, each penalty method by 143 µm or more in some motion");
  EXPECT_EQ(glance_answer({{"impact", motion(1e-6, 2e-3)}}),
            "At 1 ms order 2 errs by at most 1 µm, each penalty method by 800 µm or more in some motion");
}

TEST(ErrorAnswer, CountsTheMotionsOfWhichEachOrderKeepsWhatItPromises) {
  std::vector<Runs> bends = motion(1e-6, 1e-5);
  bends[0] = runs("1", 3e-3, 1.0, 30.0);
  EXPECT_EQ(order_answer({{"slide", motion(1e-6, 1e-5)}, {"geodesic", bends}}),
            "Order 2's error is rounding or falls at least by the timestep's square in 2 of 2 motions, order 1's in 1");
}

}  // namespace
}  // namespace proxarm::studies
