// A session in somebody's own program is that of the command line: the same checks, the same words, the same setpoints.
// tests/command_line/library_test.py holds it against the program itself.
#include "controller/library/session.hpp"

#include <gtest/gtest.h>

#include <stdexcept>
#include <string>

#include "sim/physics/hand.hpp"

namespace proxarm {
namespace {

// Everything in free space goes where it wants.
class Nothing final : public GeometricAlgorithm<3> {
 public:
  Vec3 operator()(double, const Vec3& p, const Vec3&) noexcept override { return p; }
};

// What is refused, in words; empty: nothing.
template <typename Do>
std::string refused(Do&& act) {
  try {
    act();
  } catch (const SetupError& error) {
    return error.what();
  }
  return "";
}

TEST(Session, BeginsAnewWithEachRun) {
  Session session({.duration_s = 0.5});
  const std::string first = session.run().setpoint_sha256;
  EXPECT_EQ(session.run().setpoint_sha256, first);
  EXPECT_EQ(first.size(), 64U);
}

TEST(Session, ShowsEveryCycleInOrderWithTheTruthInIt) {
  Session session({.duration_s = 0.5});
  std::uint64_t next = 0, rendered = 0;
  const Summary summary = session.run([&](const CycleRecord& cycle) {
    EXPECT_EQ(cycle.cycle, next++);
    EXPECT_TRUE(cycle.has(controller::RecordFlag::truth));
    if (cycle.phase == controller::Phase::rendering) ++rendered;
  });
  EXPECT_EQ(summary.cycles, next);
  EXPECT_EQ(rendered, 500U);
  EXPECT_TRUE(summary.from_truth);
  EXPECT_EQ(summary.end.reason, "duration");
  EXPECT_TRUE(summary.faults.empty());
}

TEST(Session, IsRefusedWithTheWordsOfTheCommandLine) {
  EXPECT_EQ(refused([] { Session({.mass_kg = -1.0}); }),
            "--mass: found \"-1\", expected a mass above zero, such as 3kg");
  EXPECT_EQ(refused([] { Session({.order = 3}); }), "--order: found 3, expected 1 or 2");
  EXPECT_NE(refused([] { Session({.scene = "scenes/absent.yaml"}); }).find("--scene: scenes/absent.yaml: no such file"),
            std::string::npos);
  EXPECT_NE(refused([] { Session({.mass_kg = 0.5}); }).find("--mass: "), std::string::npos);        // unstable
  EXPECT_NE(refused([] { Session({.timestep_s = 5e-4}); }).find("--timestep"), std::string::npos);  // the bus
}

TEST(Session, StopsWhenItIsAskedTo) {
  Session session({.duration_s = 5.0});
  const Summary summary = session.run([&](const CycleRecord& cycle) {
    if (cycle.time_ns > 1'000'000'000) session.stop();
  });
  EXPECT_EQ(summary.end.reason, "asked");
  EXPECT_LT(summary.rendered_time_s, 2.0);
  EXPECT_TRUE(summary.faults.empty());
}

TEST(Session, AHandOfOnesOwnThatPullsAsTheFilesDoesMovesTheArmAlike) {
  const SessionOptions options{.duration_s = 3.0};
  Session with_file(options);
  const std::string expected = with_file.run().setpoint_sha256;
  Session with_own(options);
  const command_line::PreparedSession& prepared = with_own.prepared();
  // What the simulated arm is made of, for the place at which its hand takes hold of it.
  const sim::Plant there(prepared.cell, prepared.sensor, prepared.hand);
  const sim::Hand hand(prepared.hand, there.tool().X_WT);
  int calls = 0;
  with_own.set_hand([&](double time_s, const Vec3& position_W, const Vec3& velocity_W) -> Vec3 {
    ++calls;
    return hand.force_W(time_s, position_W, velocity_W);
  });
  EXPECT_EQ(with_own.run().setpoint_sha256, expected);
  EXPECT_GT(calls, 12'000);  // each 0.25 ms
}

TEST(Session, WhatTheHandThrowsComesOutOfTheRun) {
  Session session({.duration_s = 2.0});
  session.set_hand([](double time_s, const Vec3&, const Vec3&) -> Vec3 {
    if (time_s > 0.5) throw std::runtime_error("let go");
    return Vec3::Zero();
  });
  EXPECT_THROW(session.run(), std::runtime_error);
  session.set_hand({});
  EXPECT_EQ(session.run().end.reason, "duration");
}

TEST(Session, AWorldOfOnesOwnIsTheOnlyOne) {
  Nothing nothing;
  Session free({.duration_s = 4.0});
  const Summary summary = free.set_world(nothing).run();
  EXPECT_EQ(summary.contacts, 0U);  // the cell's own scene has a wall
  EXPECT_EQ(refused([&] { Session({.scene = "scenes/wall.yaml"}).set_world(nothing); }),
            "--scene: found a world of one's own, expected one of the two");
  EXPECT_EQ(refused([&] { Session({.lookahead = "auto"}).set_world(nothing); }),
            "--lookahead: found a world of one's own, expected off with it");
  EXPECT_NE(
      refused([&] { Session({.cell = "models/cells/linear.yaml"}).set_world(nothing); }).find("in all directions"),
      std::string::npos);
}

TEST(Session, ADriveForAJointThatIsntThereIsRefused) {
  Session session({.duration_s = 0.5});
  session.set_drive("axis_9", [](controller::FarEnd&, std::size_t, const description::DriveDescription&) {
    return std::unique_ptr<fieldbus::CyclicDrive>();
  });
  EXPECT_NE(refused([&] { session.run(); }).find("no joint \"axis_9\""), std::string::npos);
}

}  // namespace
}  // namespace proxarm
