// The story: a tool 0.5 kg heavier than its cell said pulled with 5 N wherever it was turned, and nothing but a new
// session could tell the running one.
#include "controller/motion/tool_change.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "controller/motion/wrench_compensation.hpp"
#include "models/base/random.hpp"

namespace proxarm::controller {
namespace {

using models::Mat3;
using models::Vec3;
using models::Wrench;
using Why = ToolDoubt::Why;

const Vec3 gravity_W(0.0, 0.0, -9.80665);
constexpr double open_N = 3e-3;

description::Cell cell_of(const HeldTool& tool) {
  description::Cell cell;
  cell.tool.mass_kg = tool.mass_kg;
  for (std::size_t i = 0; i < 3; ++i) {
    cell.tool.centre_of_mass_S_m[i] = tool.centre_S[static_cast<Eigen::Index>(i)];
    cell.tool.handle_S.position_m[i] = tool.handle_S[static_cast<Eigen::Index>(i)];
  }
  return cell;
}

const HeldTool said{0.25, Vec3(0.0, 0.0, 0.06), Vec3(0.0, 0.0, 0.1)};
const HeldTool real{0.75, Vec3(0.02, -0.01, 0.09), said.handle_S};

// By statics: what a sensor reads of this tool, with this zero.
Wrench reading_S(const HeldTool& tool, const Mat3& R_WS) {
  const Vec3 weight_S = tool.mass_kg * (R_WS.transpose() * gravity_W);
  return {Vec3(12.0, -7.0, 30.0) + weight_S, Vec3(0.5, -0.2, 0.1) + tool.centre_S.cross(weight_S)};
}

Mat3 tilted(double rad) { return Eigen::AngleAxisd(rad, Vec3(0.6, 0.8, 0.0)).toRotationMatrix(); }

WrenchCompensation tared(const HeldTool& with, const Mat3& R_WS) {
  WrenchCompensation compensation(cell_of(with));
  for (int k = 0; k < 10; ++k) compensation.add_tare_sample(reading_S(real, R_WS), R_WS);
  compensation.finish_tare();
  return compensation;
}

TEST(ToolChange, IsAsIfTheSensorHadBeenTaredWithTheNewFiguresWhateverThePose) {
  models::Random random(7);
  const Mat3 R_tare = tilted(0.3);
  WrenchCompensation changed = tared(said, R_tare), right = tared(real, R_tare);
  changed.set_tool(real.mass_kg, real.centre_S);
  for (int i = 0; i < 100; ++i) {
    const Mat3 R_WS = tilted(random.uniform(-3.0, 3.0));
    const Wrench one = changed.hand_wrench_W(reading_S(real, R_WS), R_WS);
    const Wrench other = right.hand_wrench_W(reading_S(real, R_WS), R_WS);
    // Rounding of some 30 N.
    EXPECT_LT((one.force - other.force).norm(), 1e-13);
    EXPECT_LT((one.torque - other.torque).norm(), 1e-13);
    EXPECT_LT(one.force.norm(), 1e-13);
  }
}

TEST(ToolChange, LearnsAnewWhereAnEmptyHandleRests) {
  const Mat3 R_tare = tilted(0.0), R_rest = tilted(0.01);
  WrenchCompensation compensation = tared(said, R_tare);
  // Most of the weight's share there is followed, in steps of a twentieth.
  for (int k = 0; k < 400; ++k) {
    Wrench rest = compensation.hand_wrench_W(reading_S(real, R_rest), R_rest);
    rest = compensation.reading_S(rest, R_rest);
    rest.force *= 0.05;
    rest.torque *= 0.05;
    compensation.follow_bias(rest, 10.0, 10.0);
    compensation.learn_at(R_rest, 0.05);
  }
  EXPECT_LT(compensation.turned_gravity_S(R_rest).norm(), 1e-8);  // 0.95^400
  compensation.set_tool(real.mass_kg, real.centre_S);
  for (const double rad : {0.0, 0.01, 0.5, 2.0}) {
    const Mat3 R_WS = tilted(rad);
    EXPECT_LT(compensation.hand_wrench_W(reading_S(real, R_WS), R_WS).force.norm(), 1e-8);
  }
}

TEST(ToolChange, FadesInEvenlyAndNoForceChangesFasterThanTwoNewtonsASecond) {
  const Mat3 R_tare = tilted(0.0), R_now = tilted(2.5);
  WrenchCompensation compensation = tared(said, R_tare);
  ToolChange change(cell_of(said).tool);
  const ToolEvidence seen{.hand_S = {}, .turned_S = compensation.turned_gravity_S(R_now)};
  const double by_N = seen.change(said, real).force.norm();
  EXPECT_GT(by_N, 9.0);
  change.take(real, {seen.change(said, real).force, Vec3::Zero()});
  int cycles = 0;
  Wrench last = compensation.hand_wrench_W(reading_S(real, R_now), R_now);
  while (change.step(1e-3)) {
    compensation.set_tool(change.present().mass_kg, change.present().centre_S);
    const Wrench now = compensation.hand_wrench_W(reading_S(real, R_now), R_now);
    EXPECT_LT((now.force - last.force).norm(), 2e-3 + 1e-12);  // rounding
    last = now;
    ++cycles;
  }
  EXPECT_NEAR(cycles, 500.0 * by_N, 1.0);
  EXPECT_EQ(change.present().mass_kg, real.mass_kg);
  EXPECT_EQ(change.present().centre_S, real.centre_S);
  EXPECT_LT(last.force.norm(), 1e-11);  // thousands of roundings of some 30 N
}

TEST(ToolChange, GoesOnFromWhereItIsWhenAnotherComesInBetween) {
  ToolChange change(cell_of(said).tool);
  change.take(real, {});
  for (int k = 0; k < 500; ++k) EXPECT_TRUE(change.step(1e-3));
  EXPECT_NEAR(change.present().mass_kg, 0.5, 1e-12);
  change.take(said, {});
  EXPECT_TRUE(change.step(1e-3));
  EXPECT_NEAR(change.present().mass_kg, 0.5 - 0.25e-3, 1e-12);
  while (change.step(1e-3)) {
  }
  EXPECT_EQ(change.present().mass_kg, said.mass_kg);
}

ToolEvidence evidence(const HeldTool& hanging, double turned_rad, double zero_limit_N,
                      const Vec3& hand_N = Vec3::Zero()) {
  const Mat3 R_tare = Mat3::Identity(), R_WS = tilted(turned_rad);
  WrenchCompensation compensation(cell_of(said));
  compensation.add_tare_sample(reading_S(hanging, R_tare), R_tare);
  compensation.finish_tare();
  const Wrench hand_W = compensation.hand_wrench_W(reading_S(hanging, R_WS), R_WS);
  return {.hand_S = {R_WS.transpose() * (hand_W.force + hand_N), R_WS.transpose() * hand_W.torque},
          .turned_S = compensation.turned_gravity_S(R_WS),
          .learnt_S = compensation.learnt_gravity_S(),
          .zero_off_S = compensation.tared_S() - Vec3(12.0, -7.0, 30.0),
          .zero_limit_N = zero_limit_N,
          .open_N = open_N};
}

TEST(ToolChange, TakesWhatTheSensorShowsAndRefusesWhatItDoesnt) {
  constexpr double unknown = std::numeric_limits<double>::infinity();
  const HeldTool wrong{1.25, said.centre_S, said.handle_S};
  for (const double turned_rad : {0.3, 1.0, 3.0}) {
    EXPECT_EQ(evidence(real, turned_rad, unknown).doubt(said, real).why, Why::none) << turned_rad;
    // 1 kg more than hangs there.
    EXPECT_EQ(evidence(said, turned_rad, unknown).doubt(said, wrong).why, Why::force) << turned_rad;
    // More than half of what it lacks is nearer to it, and so it's taken; the double isn't.
    const HeldTool most{0.55, said.centre_S, said.handle_S}, twice{1.25, said.centre_S, said.handle_S};
    EXPECT_NE(evidence(real, turned_rad, unknown).doubt(said, twice).why, Why::none) << turned_rad;
    EXPECT_EQ(evidence({0.75, said.centre_S, said.handle_S}, turned_rad, unknown).doubt(said, most).why, Why::none);
    // A centre that is 5 cm off.
    const HeldTool beside{real.mass_kg, real.centre_S + Vec3(0.05, 0.0, 0.0), real.handle_S};
    EXPECT_EQ(evidence(real, turned_rad, unknown).doubt(real, beside).why, Why::torque) << turned_rad;
  }
  // As the sensor was held when it was tared, nothing changes, and nothing can be told.
  EXPECT_EQ(evidence(said, 0.0, unknown).doubt(said, wrong).why, Why::none);
}

TEST(ToolChange, ARememberedZeroConfirmsAMassWhileAHandIsThereAndRefusesAWrongOne) {
  const Vec3 hand_N(20.0, 5.0, 0.0);
  const HeldTool heavier{0.75, said.centre_S, said.handle_S}, wrong{3.25, said.centre_S, said.handle_S};
  // A hand that compensates what is read hides the tool; the zero doesn't.
  EXPECT_EQ(evidence(heavier, 1.0, 3.0, hand_N).doubt(said, heavier).why, Why::none);
  // The tare itself says no, in any pose.
  for (const double turned_rad : {0.0, 0.02, 1.0}) {
    const ToolDoubt doubt = evidence(heavier, turned_rad, 3.0, hand_N).doubt(said, wrong);
    EXPECT_EQ(doubt.why, Why::zero) << turned_rad;
    EXPECT_NEAR(doubt.would_be, 2.5 * 9.80665, 1e-9);
    EXPECT_EQ(doubt.limit, 3.0);
  }
}

TEST(ToolChange, WhatIsTakenUnseenIsNoMoreThanTheTareLeavesOpen) {
  // All figures that a sensor which shows nothing lets pass, at many poses: what they change is no more than is open.
  models::Random random(11);
  int taken = 0;
  for (int i = 0; i < 20000; ++i) {
    const HeldTool wanted{random.uniform(0.0, 3.0),
                          Vec3(random.uniform(-0.2, 0.2), random.uniform(-0.2, 0.2), random.uniform(-0.2, 0.2)),
                          said.handle_S};
    const double limit_N = random.chance(0.5) ? 3.3 : std::numeric_limits<double>::infinity();
    const ToolEvidence seen = evidence(said, std::pow(10.0, random.uniform(-5.0, 0.5)), limit_N);
    if (seen.doubt(said, wanted).why != Why::none) continue;
    ++taken;
    const Wrench by = seen.change(said, wanted);
    EXPECT_LE((seen.hand_S.force + by.force).norm(), open_N + 1e-9);
    EXPECT_LE((seen.hand_S.torque + by.torque).norm(), 0.1 * open_N + 1e-9);
  }
  EXPECT_GT(taken, 500);
}

TEST(ToolChange, WhatIsToldToOtherThreadsIsTheSame) {
  const ToolEvidence seen = evidence(real, 1.0, 3.3, Vec3(1.0, 2.0, 3.0));
  EXPECT_EQ(ToolEvidence::of(seen.numbers()).numbers(), seen.numbers());
  EXPECT_EQ(ToolEvidence::of(seen.numbers()).hand_S.force, seen.hand_S.force);
}

TEST(ToolChange, BeforeTheTareNothingIsDoubted) {
  ToolEvidence seen;
  seen.hand_S.force = Vec3(30.0, 0.0, 0.0);
  seen.turned_S = Vec3(0.0, 0.0, 9.8);
  EXPECT_EQ(seen.doubt(said, real).why, Why::none);
}

}  // namespace
}  // namespace proxarm::controller
