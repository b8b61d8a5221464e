#include "controller/motion/wrench_compensation.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace {

using namespace proxarm;
using models::Mat3;
using models::Vec3;
using models::Wrench;

description::Cell cell_with_tool() {
  description::Cell cell;
  cell.tool.mass_kg = 0.25;
  cell.tool.centre_of_mass_S_m = {0.01, -0.02, 0.05};
  cell.tool.handle_S.position_m = {0.0, 0.0, 0.1};
  return cell;
}

Mat3 random_rotation(std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  return Eigen::Quaterniond(normal(random), normal(random), normal(random), normal(random)).normalized().matrix();
}

TEST(WrenchCompensation, WeighsTheToolDownwardsInWorldWhateverTheOrientation) {
  const controller::WrenchCompensation compensation(cell_with_tool());
  std::mt19937_64 random(1);
  for (int i = 0; i < 100; ++i) {
    const Mat3 R_WS = random_rotation(random);
    const Vec3 weight_W = R_WS * compensation.tool_weight_S(R_WS).force;
    EXPECT_NEAR(weight_W.x(), 0.0, 1e-14);
    EXPECT_NEAR(weight_W.z(), -0.25 * 9.80665, 1e-14);
  }
}

// The reading is built by statics from the other end: a hand's force at T and the weight at the centre of mass.
TEST(WrenchCompensation, FindsTheHandsForceAfterTaringInAnotherOrientation) {
  const description::Cell cell = cell_with_tool();
  std::mt19937_64 random(2);
  std::normal_distribution<double> normal;
  const auto random_vector = [&] { return Vec3(normal(random), normal(random), normal(random)); };
  for (int i = 0; i < 100; ++i) {
    controller::WrenchCompensation compensation(cell);
    const Wrench bias_S{20.0 * random_vector(), random_vector()};
    const auto reading = [&](const Mat3& R_WS, const Vec3& force_W, const Vec3& torque_W) {
      const Vec3 c(cell.tool.centre_of_mass_S_m.data());
      const Vec3 t(cell.tool.handle_S.position_m.data());
      const Vec3 weight_S = R_WS.transpose() * Vec3(0.0, 0.0, -0.25 * 9.80665);
      const Vec3 force_S = R_WS.transpose() * force_W;
      return Wrench{bias_S.force + force_S + weight_S,
                    bias_S.torque + R_WS.transpose() * torque_W + t.cross(force_S) + c.cross(weight_S)};
    };
    const Mat3 R_tare = random_rotation(random);
    const Wrench at_rest = reading(R_tare, Vec3::Zero(), Vec3::Zero());
    for (int k = 0; k < 10; ++k) compensation.add_tare_sample(at_rest, R_tare);
    compensation.finish_tare();

    const Mat3 R_WS = random_rotation(random);
    const Vec3 force_W = 30.0 * random_vector(), torque_W = random_vector();
    const Wrench hand = compensation.hand_wrench_W(reading(R_WS, force_W, torque_W), R_WS);
    // Sums of numbers up to 100 N in double precision: a few hundred units in the last place.
    EXPECT_LT((hand.force - force_W).norm(), 1e-12);
    EXPECT_LT((hand.torque - torque_W).norm(), 1e-12);
  }
}

TEST(WrenchCompensation, TellsAHandOnTheHandleByTheSpreadOfTheReadings) {
  controller::WrenchCompensation compensation(cell_with_tool());
  const Mat3 R_WS = Mat3::Identity();
  const Wrench weight = compensation.tool_weight_S(R_WS);
  for (int k = 0; k < 50; ++k) compensation.add_tare_sample(weight, R_WS);
  EXPECT_LT(compensation.tare_spread_N(), 1e-15);
  Wrench pushed = weight;
  pushed.force.x() += 2.0;
  compensation.add_tare_sample(pushed, R_WS);
  EXPECT_NEAR(compensation.tare_spread_N(), 2.0, 1e-12);
}

// The story: a hand that shook the handle during the tare was taken for noise, the band in which nobody counts as there
// grew to newtons, and the arm braked that hand from then on.
TEST(WrenchCompensation, TellsNoiseFromAHandThatMovesTheHandleDuringTheTare) {
  const auto tared = [](auto force_N) {
    controller::WrenchCompensation compensation(cell_with_tool());
    for (int k = 0; k < 200; ++k) {
      compensation.add_tare_sample({force_N(1e-3 * k) - Vec3(0.0, 0.0, 0.25 * 9.80665), Vec3::Zero()},
                                   Mat3::Identity());
    }
    compensation.finish_tare();
    return compensation;
  };
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  const auto noise = [&](double sigma_N) {
    return Vec3(sigma_N * Vec3(normal(random), normal(random), normal(random)));
  };
  for (const double sigma_N : {0.0, 0.02, 2.0}) {
    for (int trial = 0; trial < 100; ++trial) {
      EXPECT_TRUE(tared([&](double) { return noise(sigma_N); }).noise_is_white()) << sigma_N;
    }
  }
  EXPECT_TRUE(tared([](double) { return Vec3(100.0, -3.0, 0.1); }).noise_is_white()) << "a force that doesn't change";
  for (const double f : {0.5, 1.0, 5.0, 8.0, 12.0, 30.0}) {
    const auto shaken =
        tared([&](double t) { return Vec3(noise(0.02) + Vec3(0.0, std::sin(2.0 * M_PI * f * t + 1.0), 0.0)); });
    EXPECT_FALSE(shaken.noise_is_white()) << f << " Hz";
    EXPECT_GT(shaken.noise_N(), 2.0 * 0.02) << f << " Hz";
  }
}

}  // namespace
