// A session in somebody's own program is that of the command line: the same checks, the same words, the same setpoints.
// tests/command_line/library_test.py holds it against the program itself.
#include "controller/library/session.hpp"

#include <gtest/gtest.h>

#include <stdexcept>
#include <string>
#include <vector>

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
  Session session({{"duration", 0.5}});
  const std::string first = session.run().setpoint_sha256;
  EXPECT_EQ(session.run().setpoint_sha256, first);
  EXPECT_EQ(first.size(), 64U);
}

TEST(Session, ShowsEveryCycleInOrderWithTheTruthInIt) {
  Session session({{"duration", 0.5}});
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
  EXPECT_EQ(refused([] {
              Session({{"mass", -1.0}});
            }),
            "--mass: found \"-1\", expected a mass above zero, such as 3kg");
  EXPECT_EQ(refused([] { Session({{"order", 3}}); }), "--order: found \"3\", expected 1 or 2");
  EXPECT_NE(refused([] {
              Session({{"scene", "scenes/absent.yaml"}});
            }).find("--scene: scenes/absent.yaml: no such file"),
            std::string::npos);
  EXPECT_NE(refused([] { Session({{"mass", 0.5}}); }).find("--mass: "), std::string::npos);         // unstable
  EXPECT_NE(refused([] { Session({{"timestep", 5e-4}}); }).find("--timestep"), std::string::npos);  // the bus
}

TEST(Session, StopsWhenItIsAskedTo) {
  Session session({{"duration", 5.0}});
  const Summary summary = session.run([&](const CycleRecord& cycle) {
    if (cycle.time_ns > 1'000'000'000) session.stop();
  });
  EXPECT_EQ(summary.end.reason, "asked");
  EXPECT_LT(summary.rendered_time_s, 2.0);
  EXPECT_TRUE(summary.faults.empty());
}

TEST(Session, AHandOfOnesOwnThatPullsAsTheFilesDoesMovesTheArmAlike) {
  const SessionOptions options{{"duration", 3.0}};
  Session with_file(options);
  const std::string expected = with_file.run().setpoint_sha256;
  Session with_own(options);
  const controller::PreparedSession& prepared = with_own.prepared();
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
  Session session({{"duration", 2.0}});
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
  Session free({{"duration", 4.0}});
  const Summary summary = free.set_world(nothing).run();
  EXPECT_EQ(summary.contacts, 0U);  // the cell's own scene has a wall
  EXPECT_EQ(refused([&] {
              Session({{"scene", "scenes/wall.yaml"}}).set_world(nothing);
            }),
            "--scene: found a world of one's own, expected one of the two");
  EXPECT_EQ(refused([&] {
              Session({{"lookahead", "auto"}}).set_world(nothing);
            }),
            "--lookahead: found a world of one's own, expected off with it");
  EXPECT_NE(refused([&] {
              Session({{"cell", "models/cells/linear.yaml"}}).set_world(nothing);
            }).find("in all directions"),
            std::string::npos);
}

TEST(Session, TakesOptionsByTheirNames) {
  EXPECT_EQ(refused([] {
              Session({{"masss", 4}});
            }),
            "unknown option \"--masss\"; did you mean --mass?; see proxarm run --help");
  EXPECT_EQ(refused([] { Session({{"no_plot", "yes"}}); }), "--no-plot: found \"yes\", expected true or false");
  EXPECT_NE(refused([] { Session({{"bus", "can0"}}); }).find("real arm"), std::string::npos);
  EXPECT_EQ(refused([] { Session({{"view", false}, {"bus", "sim"}, {"extra_delay", 0.001}}); }), "");
  EXPECT_NE(refused([] { Session({{"extra-delay", 0.001}, {"extra_delay", "1ms"}}); }), "");  // one option, twice
  Session with_faults({{"duration", 2.0}, {"fault", {"sensor:drift=0.1@1s", "axis_2:silent@1.5s"}}});
  const Summary summary = with_faults.run();
  ASSERT_EQ(summary.faults.size(), 1U);
  EXPECT_EQ(summary.faults[0].fault, controller::Fault::drive_silent);
}

TEST(Session, IsChangedWhileItRunsAndAtNoOtherTime) {
  Session session({{"duration", 2.0}});
  EXPECT_EQ(refused([&] { session.ask("hold"); }), "found \"hold\", expected a session that runs to ask it of");
  std::string answer, refusal;
  double felt_kg = 0.0;
  session.run([&](const CycleRecord& cycle) {
    if (cycle.time_ns > 1'000'000'000 && answer.empty()) {
      answer = session.ask("mass=8kg\tdamping=5");
      refusal = refused([&] { session.ask("mass=0.1"); });
    }
    if (cycle.phase == controller::Phase::rendering) felt_kg = cycle.proxy_mass_kg + cycle.tool_mass_kg;
  });
  EXPECT_EQ(answer, "mass=8kg\tdamping=5");
  EXPECT_EQ(refusal.substr(0, 8), "mass=0.1");
  EXPECT_DOUBLE_EQ(felt_kg, 8.0);
  EXPECT_NE(refused([&] { session.ask("status"); }), "");
}

// A wall that has a name and touches a centimetre beside the proxy.
class NamedWall final : public OwnWorld {
 public:
  Vec3 operator()(double, const Vec3& p, const Vec3&) noexcept override {
    pressed_ = p.x() > 0.75;
    if (!pressed_) return p;
    const Vec3 on(0.75, p.y(), p.z());
    point_W_ = on + Vec3(0.0, 0.0, 0.01);
    return on;
  }
  [[nodiscard]] std::span<const models::Contact<3>> contacts() const noexcept override {
    return {&contact_, pressed_ ? 1U : 0U};
  }
  [[nodiscard]] std::vector<std::string> objects() const override { return {"air", "wall"}; }
  [[nodiscard]] std::span<const Vec3> contact_points_W() const noexcept override { return {&point_W_, 1}; }

 private:
  models::Contact<3> contact_{.object = 1, .normal = -Vec3::UnitX()};
  Vec3 point_W_ = Vec3::Zero();
  bool pressed_ = false;
};

TEST(Session, AWorldSaysWhereItTouchesAndWhat) {
  NamedWall wall;
  Session session({{"duration", 4.0}});
  EXPECT_EQ(session.objects(), std::vector<std::string>{"wall"});  // the cell's own scene
  session.set_world(wall);
  EXPECT_EQ(session.objects(), (std::vector<std::string>{"air", "wall"}));
  int touching = 0;
  session.run([&](const CycleRecord& cycle) {
    if (cycle.recorded_contacts() == 0) return;
    ++touching;
    EXPECT_EQ(cycle.contacts[0].object, 1);
    EXPECT_DOUBLE_EQ(cycle.contacts[0].point_W_m[2], cycle.proxy_W_m[2] + 0.01);
  });
  EXPECT_GT(touching, 500);
}

TEST(Session, AToolWithAShapeHasNoWorldOfOnesOwn) {
  Nothing nothing;
  EXPECT_EQ(refused([&] {
              Session({{"tool", "scenes/tools/rod.yaml"}, {"inertia", 0.1}}).set_world(nothing);
            }),
            "--tool: found a tool with a shape, and a world of one's own, expected point: such a world moves a point");
}

TEST(Session, ADriveForAJointThatIsntThereIsRefused) {
  Session session({{"duration", 0.5}});
  session.set_drive("axis_9", [](controller::FarEnd&, std::size_t, const description::DriveDescription&) {
    return std::unique_ptr<fieldbus::CyclicDrive>();
  });
  EXPECT_NE(refused([&] { session.run(); }).find("no joint \"axis_9\""), std::string::npos);
}

}  // namespace
}  // namespace proxarm
