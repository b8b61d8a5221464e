// The point that the arm is sent to goes where it is predicted, and never jumps.
#include "controller/limits/sent_point.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace proxarm::controller {
namespace {

using models::Vec3;

constexpr double T = 1e-3;

description::CellLimits cell_limits() {
  description::CellLimits limits;
  limits.setpoint_bandwidth_Hz = 25.0;
  return limits;
}

TEST(SentPoint, FollowsThePredictionWhereNoLimitActs) {
  SentPoint sent(cell_limits(), 8e-3, T);
  sent.start(Vec3::Zero());
  const Vec3 predicted(1e-3, 2e-3, 3e-3);
  sent.step(Vec3::Zero(), predicted, {});
  EXPECT_LT((sent.c_k1_W() - predicted).norm(), 1e-15);
  EXPECT_EQ(sent.c_k2_W(), Vec3(Vec3::Zero()));
  EXPECT_EQ(sent.active().kinds, 0);
}

TEST(SentPoint, KeepsWithinTheSpeed) {
  SentPoint sent(cell_limits(), 8e-3, T);
  sent.start(Vec3::Zero());
  StepLimits limits;
  limits.hard[0] = {Vec3::Zero(), 0.5 * T, Limit::speed};
  limits.hard_count = 1;
  Vec3 last = Vec3::Zero();
  for (int k = 0; k < 20; ++k) {
    sent.step(Vec3::Zero(), Vec3(5e-3, 0.0, 0.0), limits);
    ASSERT_LE((sent.c_k1_W() - last).norm(), 0.5 * T * (1.0 + 1e-9));
    last = sent.c_k1_W();
    EXPECT_EQ(sent.active().has(Limit::speed), k < 9) << "5 mm are ten steps";
  }
  EXPECT_NEAR(last.x(), 5e-3, 1e-12) << "nothing winds up";
}

TEST(SentPoint, TheHorizonMovesSlowly) {
  SentPoint sent(cell_limits(), 8e-3, T);
  EXPECT_EQ(sent.horizon_s(), 8e-3) << "a session begins with it";
  sent.want(0.0);
  double last = sent.horizon_s();
  int cycles = 0;
  for (; sent.horizon_s() > 0.0 && cycles < 2000; ++cycles) {
    sent.advance_horizon();
    ASSERT_LE(std::abs(sent.horizon_s() - last), SentPoint::horizon_rate * T * (1.0 + 1e-9));
    last = sent.horizon_s();
  }
  EXPECT_NEAR(cycles, 800, 1);
  sent.want(-1.0);
  sent.want(std::nan(""));
  sent.advance_horizon();
  EXPECT_EQ(sent.horizon_s(), 0.0) << "what is no horizon changes nothing";
}

// The prediction of another mass lies 0.2 mm away: at once that would be 0.2 m/s more.
TEST(SentPoint, AChangeOfTheMassMovesItSlowly) {
  SentPoint sent(cell_limits(), 8e-3, T);
  sent.start(Vec3::Zero());
  const double v = 0.1;
  Vec3 q = Vec3::Zero(), last_step = Vec3(v * T, 0.0, 0.0);
  for (int k = 0; k < 1000; ++k) {
    q.x() += v * T;
    if (k == 300) sent.take_up_change();
    const Vec3 before = sent.c_k1_W();
    sent.step(q, q + Vec3(k < 300 ? 8e-4 : 10e-4, 0.0, 0.0), {});
    const Vec3 step = sent.c_k1_W() - before;
    if (k > 1) {  // before, it goes to where the prediction begins
      // 0.2 mm that fade in 50 ms: 4 mm/s at first.
      ASSERT_LE((step - last_step).norm(), 2e-4 * T / SentPoint::fading_s * 1.01) << "cycle " << k;
    }
    last_step = step;
  }
  EXPECT_NEAR(sent.c_k1_W().x(), q.x() + 10e-4, 1e-8);
}

TEST(SentPoint, GoesOnFromWhereTheArmIs) {
  SentPoint sent(cell_limits(), 8e-3, T);
  sent.start(Vec3::Zero());
  const Vec3 c(0.1, 0.2, 0.3), v(0.2, 0.0, -0.1);
  const Vec3 q = c - 8e-3 * v + Vec3(0.0, 0.0, 1e-4);  // joints that turned on would lead it there
  sent.resume(c, q, v);
  EXPECT_EQ(sent.c_k1_W(), c);
  EXPECT_LT((sent.c_k1_W() - sent.c_k2_W() - T * v).norm(), 1e-15);
  const double omega = 2.0 * 3.14159265358979 * 25.0;
  EXPECT_LT((sent.filtered_W() + 2.0 / omega * sent.filtered_velocity_W() - q).norm(), 1e-12);
  // Where the scene leads the proxy is beside c by 0.1 mm: c goes on as it did, and comes there as the offset fades.
  sent.step(q + T * v, q + T * v + 8e-3 * v, {});
  EXPECT_LT((sent.c_k1_W() - (c + T * v)).norm(), 1e-12);
}

// The proxy's own filter: behind it by 2/ω at a constant speed, as the arm's is behind what is commanded.
TEST(SentPoint, FiltersTheProxyAsTheArmIsFiltered) {
  SentPoint sent(cell_limits(), 8e-3, T);
  sent.start(Vec3::Zero());
  const Vec3 v(0.1, 0.0, 0.0);
  Vec3 q = Vec3::Zero();
  for (int k = 0; k < 500; ++k) sent.step(q += T * v, q, {});
  const double omega = 2.0 * 3.14159265358979 * 25.0;
  EXPECT_NEAR((q - sent.filtered_W()).x(), 0.1 * (2.0 / omega), 0.1 * T);
  // An input that holds still over each period leaves a ripple of (ωT)²/12.
  EXPECT_NEAR(sent.filtered_velocity_W().x(), 0.1, 0.1 * omega * omega * T * T / 11.0);
}

}  // namespace
}  // namespace proxarm::controller
