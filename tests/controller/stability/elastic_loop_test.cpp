// The stability check on elastic gears, held against the simulated arm itself: what it takes for unstable swings more
// and more, and what it takes for stable comes to rest. The story: with rigid links in it, 1.5 kg were stable at any
// timestep; the arm swung by 9 mm with 2 kg at 2 ms.
#include "controller/stability/elastic_loop.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include "controller/stability/stability.hpp"
#include "tests/controller/closed_loop/closed_loop_rig.hpp"
#include "tests/source_file.hpp"

namespace proxarm::controller {
namespace {

using models::Vec3;
using testing::ClosedLoopRig;
using testing::RigOptions;

// At the start, and where the tool is led to without being turned.
std::vector<ElasticArm> elastic_arms(const models::Arm& arm, const description::Cell& cell,
                                     const std::vector<Vec3>& offsets_W) {
  std::vector<Lead> leads;
  for (const Vec3& offset_m : offsets_W) leads.push_back({.offset_m = offset_m});
  std::vector<ElasticArm> arms;
  for (const models::JointVector& pose_rad : led_poses(arm, leads)) arms.push_back(elastic_arm(arm, pose_rad, cell));
  return arms;
}

LoopModel loop_of(const description::Cell& cell, double period_s, const std::vector<Vec3>& offsets_W = {}) {
  const double pi = std::numbers::pi;
  const models::Arm arm(cell);
  LoopModel loop;
  loop.period_s = period_s;
  loop.delay_s = period_s + 0.5 / cell.sensor.sample_rate_Hz + 1.0 / (2.0 * pi * cell.sensor.bandwidth_Hz) +
                 2.0 / (2.0 * pi * cell.limits.setpoint_bandwidth_Hz);
  loop.drive_time_constant_s = 1.0 / (2.0 * pi * cell.drives[0].position_bandwidth_Hz);
  loop.handle_mass_kg = cell.tool.mass_kg;
  loop.arms = std::make_shared<const std::vector<ElasticArm>>(elastic_arms(arm, cell, offsets_W));
  return loop;
}

// A hand that moves the tool by 5 mm and holds it there.
std::string nudging_hand(const HandModel& hand) {
  const std::string file =
      ::testing::TempDir() + "nudge-" + std::to_string(getpid()) + ".yaml";  // tests run side by side
  std::ofstream(file) << "name: nudge\nmass_kg: " << hand.mass_kg << "\nstiffness_N_per_m: " << hand.stiffness_N_per_m
                      << "\ndamping_Ns_per_m: " << hand.damping_Ns_per_m
                      << "\nwaypoints:\n  - {time_s: 0.3, offset_m: [0, 0, 0]}\n"
                      << "  - {time_s: 0.45, offset_m: [0.003, 0.003, 0.003]}\n";
  return file;
}

// Half of what the steel moves from peak to peak in a quarter of a second of rendering.
double swing_m(const ClosedLoopRig& rig, double from_s) {
  Vec3 low = Vec3::Constant(1e9), high = -low;
  for (std::size_t k = 0; k < rig.records.size(); ++k) {
    const double t = 1e-9 * static_cast<double>(rig.records[k].time_ns - rig.records[0].time_ns);
    if (t < from_s || t > from_s + 0.25) continue;
    const Vec3 x = rig.truths.at(k).X_WT.translation();
    low = low.cwiseMin(x);
    high = high.cwiseMax(x);
  }
  return 0.5 * (high - low).maxCoeff();
}

// What the steel swings by when it has been held for ten seconds.
double left_m(const HandModel& hand, double period_s, double felt_kg,
              const std::string& cell = "models/cells/default.yaml") {
  RigOptions options;
  options.cell = cell;
  options.settings.receive_window = 0.55;  // where drives and sensor share a bus
  options.scene = "scenes/free.yaml";
  options.hand = nudging_hand(hand);
  options.settings.mass_kg = felt_kg;
  options.settings.period_s = period_s;
  options.settings.passivity = Passivity::off;
  options.duration_s = 11.0;
  ClosedLoopRig rig(options);
  rig.run();
  return swing_m(rig, 10.5);
}

TEST(ElasticLoop, FindsTheSmallestMassThatTheSimulatedArmBears) {
  const description::Cell cell = description::load_cell(source_file("models/cells/default.yaml"));
  for (const HandModel& hand :
       {HandModel{500.0, 20.0, 1.0}, HandModel{1500.0, 40.0, 0.5}, HandModel{200.0, 10.0, 1.8}}) {
    for (const double period_s : {1e-3, 2e-3, 4e-3}) {
      SCOPED_TRACE(std::to_string(hand.mass_kg) + " kg at " + std::to_string(period_s));
      const auto smallest = smallest_stable_mass(hand, loop_of(cell, period_s));
      ASSERT_TRUE(smallest);
      const double felt_kg = *smallest + cell.tool.mass_kg;
      const double above = left_m(hand, period_s, 1.06 * felt_kg), below = left_m(hand, period_s, 0.75 * felt_kg);
      std::printf(
          "hand of %.3g kg, %.4g N/m, %.3g ms: %.2f kg; at 1.06 of it a swing of %.2g mm is left, at 0.75 %.2g\n",
          hand.mass_kg, hand.stiffness_N_per_m, 1e3 * period_s, felt_kg, 1e3 * above, 1e3 * below);
      EXPECT_LT(above, 0.05e-3);
      EXPECT_GT(below, 0.3e-3);
    }
  }
}

TEST(ElasticLoop, FindsItForArmsThatDontHaveSixAxes) {
  const HandModel hand{500.0, 20.0, 1.0};
  // (Friction in the scara's joints brings a nudge's swing to rest down to two thirds; led by a hand, it goes on at
  // 0.8.)
  struct Case {
    const char* name;
    double below;
  };
  for (const auto& [name, share_below] : {Case{"bench", 0.75}, {"gantry", 0.75}, {"scara", 0.65}, {"seven", 0.75}}) {
    const std::string file = std::string("models/cells/") + name + ".yaml";
    description::Cell cell = description::load_cell(source_file(file));
    const auto smallest = smallest_stable_mass(hand, loop_of(cell, 1e-3));
    ASSERT_TRUE(smallest) << name;
    const double felt_kg = *smallest + cell.tool.mass_kg;
    const double above = left_m(hand, 1e-3, 1.06 * felt_kg, file);
    const double below = left_m(hand, 1e-3, share_below * felt_kg, file);
    std::printf("%s: %.2f kg; at 1.06 of it a swing of %.2g mm is left, at %.2f %.2g\n", name, felt_kg, 1e3 * above,
                share_below, 1e3 * below);
    EXPECT_LT(above, 0.05e-3) << name;
    EXPECT_GT(below, 0.3e-3) << name;
  }
}

// With the torque of all gears measured, as a drive would have it: 0.05 Nm a count, half a millisecond late.
description::Cell measuring(description::Cell cell) {
  for (description::DriveDescription& drive : cell.drives) {
    drive.gear_torque = description::GearTorque{.object = 0x203100, .Nm_per_count = 0.05, .delay_s = 0.5e-3};
  }
  return cell;
}

// The story: the smallest mass is bound by what gears damp themselves: 1.8 kg on the default cell, 4.6 on the
// collaborative arm. Damped by their torque they bear a third of it, and the simulated arm agrees, with each error that
// the judge counts on.
TEST(ElasticLoop, GearsThatAreDampedByTheirTorqueBearLess) {
  const HandModel hand{500.0, 20.0, 1.0};
  struct Case {
    const char* name;
    double at_most_kg;
  };
  for (const auto& [name, at_most_kg] : {Case{"default", 0.8}, {"cobot", 1.5}, {"seven", 1.7}}) {
    const std::string file = std::string("models/cells/") + name + ".yaml";
    const description::Cell cell = measuring(description::load_cell(source_file(file)));
    LoopModel loop = loop_of(cell, 1e-3);
    const double undamped_kg = *smallest_stable_mass(hand, loop) + cell.tool.mass_kg;
    loop.gear_damping.joints = damped_joints(models::Arm(cell), cell.drives, loop.period_s);
    loop.gear_damping.damping_per_s = best_gear_damping_per_s(hand, loop);
    const double felt_kg = *smallest_stable_mass(hand, loop) + cell.tool.mass_kg;
    EXPECT_LT(felt_kg, at_most_kg) << name;
    for (const bool feed_forward : {false, true}) {
      LoopModel weak = loop;
      weak.gear_torque_ratio = 1.0 - torque_margin;
      weak.feed_forward = feed_forward;
      const ElasticLoop alone(loop.arms->front(), hand, weak);
      EXPECT_LT(alone.spectral_radius((felt_kg - cell.tool.mass_kg) / elastic_margin), 1.0)
          << name << ": a torque that is measured too small asks for more than soft gears";
    }
    EXPECT_LT(felt_kg, 0.75 * undamped_kg) << name;
    RigOptions options;
    options.cell = file;
    options.settings.receive_window = 0.55;
    options.scene = "scenes/free.yaml";
    options.hand = nudging_hand(hand);
    options.settings.mass_kg = 1.06 * felt_kg;
    options.settings.passivity = Passivity::off;
    options.settings.gear_damping_per_s = loop.gear_damping.damping_per_s;
    options.settings.damped_gears = loop.gear_damping.joints;
    options.duration_s = 6.0;
    const std::pair<const char*, std::function<void(description::SimulatedDrive&)>> errors[] = {
        {"as it is said", [](description::SimulatedDrive&) {}},
        {"a fifth too small", [](description::SimulatedDrive& drive) { drive.gear_torque_ratio = 0.8; }},
        {"a fifth too large", [](description::SimulatedDrive& drive) { drive.gear_torque_ratio = 1.2; }},
        {"an offset", [](description::SimulatedDrive& drive) { drive.gear_torque_offset_Nm = 30.0; }},
        {"hysteresis", [](description::SimulatedDrive& drive) { drive.gear_torque_hysteresis_Nm = 0.5; }},
        {"soft gears", [](description::SimulatedDrive& drive) { drive.gear_stiffness_ratio = gear_margins.front(); }},
        {"stiff gears", [](description::SimulatedDrive& drive) { drive.gear_stiffness_ratio = gear_margins.back(); }}};
    for (const auto& [what, err] : errors) {
      options.edit_cell = [&, &wrong = err](description::Cell& edited) {
        edited = measuring(edited);
        for (description::DriveDescription& drive : edited.drives) wrong(drive.simulation);
      };
      ClosedLoopRig rig(options);
      rig.run();
      EXPECT_LT(swing_m(rig, 5.5), 0.05e-3) << name << ", " << what;
    }
    // Without the damping it swings.
    options.settings.gear_damping_per_s = 0.0;
    options.edit_cell = {};
    ClosedLoopRig rig(options);
    rig.run();
    EXPECT_GT(swing_m(rig, 5.5), 0.3e-3) << name;
  }
}

// Stiff, well damped gears are rigid ones: the polynomial, with the filter as the two lags that it is, says the same.
// What is left are the hand's speed, which is a difference there, and the twentieth that elastic loops ask for.
TEST(ElasticLoop, WithStiffGearsIsTheRigidLoop) {
  description::Cell cell = description::load_cell(source_file("models/cells/default.yaml"));
  for (description::DriveDescription& drive : cell.drives) {
    drive.gear_stiffness_Nm_per_rad = 3e7;
    drive.gear_damping_Nms_per_rad = 1e5;
  }
  LoopModel loop = loop_of(cell, 1e-3);
  const HandModel hand{500.0, 20.0, 1.0};
  const double elastic_kg = *smallest_stable_mass(hand, loop);
  loop.filter_s = loop.arms->front().filter_s;
  loop.arms = nullptr;
  const double rigid_kg = *smallest_stable_mass(hand, loop);
  std::printf("stiff gears: %.3f kg, rigid ones %.3f kg\n", elastic_kg, rigid_kg);
  EXPECT_NEAR(elastic_kg, 1.05 * rigid_kg, 0.1 * rigid_kg);
}

TEST(ElasticLoop, AnOutstretchedArmNeedsMoreMass) {
  const description::Cell cell = description::load_cell(source_file("models/cells/default.yaml"));
  const HandModel hand{500.0, 20.0, 1.0};
  const double start_kg = *smallest_stable_mass(hand, loop_of(cell, 2e-3));
  const double led_kg = *smallest_stable_mass(hand, loop_of(cell, 2e-3, {Vec3(0.22, 0.18, 0.0)}));
  EXPECT_GT(led_kg, 1.3 * start_kg);
}

TEST(ElasticLoop, PosesEndAtTheEndOfTheReachAndAtSixteen) {
  const description::Cell cell = description::load_cell(source_file("models/cells/default.yaml"));
  const models::Arm arm(cell);
  EXPECT_EQ(elastic_arms(arm, cell, {}).size(), 1u);
  EXPECT_EQ(elastic_arms(arm, cell, {Vec3(0.01, 0.0, 0.0)}).size(), 1u);
  std::vector<Vec3> many;
  for (int i = 0; i < 2000; ++i) many.emplace_back(0.3 * std::sin(i), 0.3 * std::cos(1.7 * i), 0.2 * std::sin(3.1 * i));
  EXPECT_EQ(elastic_arms(arm, cell, many).size(), 16u);
  for (const ElasticArm& at : elastic_arms(arm, cell, {Vec3(5.0, 0.0, 0.0), Vec3(-5.0, 0.0, 0.0)})) {
    EXPECT_TRUE(at.mass.allFinite() && at.joints_per_m.allFinite());
  }
}

TEST(ElasticLoop, ALedToolGetsWhereItIsLedAndTurnedAsItIsTurned) {
  const description::Cell cell = description::load_cell(source_file("models/cells/default.yaml"));
  const models::Arm arm(cell);
  const models::Pose start = arm.tool_pose(arm.start_rad());
  const Vec3 away(0.1, 0.05, -0.02), turned(0.1, -0.3, 0.2);
  const auto poses =
      led_poses(arm, {{away, Vec3::Zero()}, {away, turned}, {away, 0.9 * turned}, {Vec3::Zero(), turned}});
  ASSERT_EQ(poses.size(), 4u) << "0.9 of the turning is within 0.1 rad of it";
  const models::Mat3 turning = Eigen::AngleAxisd(turned.norm(), turned.normalized()).toRotationMatrix();
  const auto expect = [&](std::size_t i, const Vec3& offset, const models::Mat3& R) {
    const models::Pose there = arm.tool_pose(poses[i]);
    EXPECT_LT((there.translation() - start.translation() - offset).norm(), 1e-6) << i;
    EXPECT_LT((there.linear() - R * start.linear()).norm(), 1e-6) << i;
  };
  expect(1, away, models::Mat3::Identity());
  expect(2, away, turning);
  expect(3, Vec3::Zero(), turning);
}

// What the horizon promises: of hands that it wasn't chosen for, too, and gears of 0.7 to 1.4 times what is believed,
// at least as many are calm with it as without; and it is long where the proxy is heavy.
TEST(ElasticLoop, AHorizonLeavesAsManyHandsCalmAsThereWereWithout) {
  const description::Cell cell = description::load_cell(source_file("models/cells/default.yaml"));
  LoopModel loop = loop_of(cell, 1e-3);
  loop.filter_s = loop.arms->front().filter_s;
  const HandModel hand{500.0, 20.0, 1.0};
  const std::pair<double, double> horizons[] = {{4.0, 10e-3}, {10.0, 14e-3}, {20.0, 14e-3}};
  for (const auto& [felt_kg, least_s] : horizons) {
    const double proxy_kg = felt_kg - cell.tool.mass_kg;
    const double horizon_s = stable_horizon_s(hand, loop, proxy_kg);
    int without = 0, with = 0;
    for (const double gears : gear_margins) {
      for (const double mass_kg : {0.3, 1.0, 2.0}) {
        for (const auto& [K, D] : {std::pair{100.0, 6.0}, {3000.0, 50.0}}) {
          loop.gear_stiffness_ratio = gears;
          loop.horizon_s = 0.0;
          without += spectral_radius({K, D, mass_kg}, loop, proxy_kg) < 1.0 ? 1 : 0;
          loop.horizon_s = horizon_s;
          with += spectral_radius({K, D, mass_kg}, loop, proxy_kg) < 1.0 ? 1 : 0;
        }
      }
    }
    loop.gear_stiffness_ratio = 1.0;
    loop.horizon_s = 0.0;
    std::printf("%.3g kg: %.3g ms ahead; of 18 hands and gears %d are calm, %d without\n", felt_kg, 1e3 * horizon_s,
                with, without);
    EXPECT_GE(horizon_s, least_s);
    EXPECT_GE(with, without);
  }
}

// The story: a setting that is calm in free motion swung without end by 0.2 mm on a layer of 61 kN/m, and eight of 56
// accepted ones did. The judge hadn't asked for layers.
LayerTouch layer_along(const Vec3& n, double stiffness_N_per_m) {
  return {.what = "layer", .spring_W = stiffness_N_per_m * n * n.transpose()};
}

LoopModel on_layers(LoopModel loop, const std::vector<LayerTouch>& layers) {
  loop.layers = std::make_shared<const std::vector<LayerTouch>>(layers);
  return loop;
}

TEST(LayerTouch, ThatPressesFromAllSidesIsTheProxysOwnSpring) {
  const description::Cell cell = description::load_cell(source_file("models/cells/default.yaml"));
  LoopModel elastic = loop_of(cell, 1e-3), rigid = elastic;
  rigid.arms = nullptr;
  const HandModel hand{500.0, 20.0, 1.0};
  for (const LoopModel& loop : {elastic, rigid}) {
    for (const double k : {500.0, 8000.0, 60000.0}) {
      const LayerTouch all{.what = "all", .spring_W = k * models::Mat3::Identity()};
      LoopModel held = loop;
      held.spring_N_per_m = k;
      for (const double mass_kg : {1.0, 3.0, 12.0}) {
        const double expected = std::max(spectral_radius(hand, loop, mass_kg), spectral_radius(hand, held, mass_kg));
        EXPECT_NEAR(spectral_radius(hand, on_layers(loop, {all}), mass_kg), expected, 1e-12) << k << " " << mass_kg;
      }
    }
  }
}

TEST(LayerTouch, NeverMakesAMassPassThatWouldntWithout) {
  const description::Cell cell = description::load_cell(source_file("models/cells/default.yaml"));
  const LoopModel loop = loop_of(cell, 2e-3);
  const HandModel hand{1000.0, 15.0, 1.5};
  const double free_kg = *smallest_stable_mass(hand, loop);
  for (const double k : {100.0, 2000.0, 20000.0, 1e6, 1e12}) {
    const LoopModel there = on_layers(loop, {layer_along(Vec3::UnitX(), k)});
    const auto least_kg = smallest_stable_mass(hand, there);
    if (least_kg) {
      EXPECT_GE(*least_kg, 0.995 * free_kg) << k;
      EXPECT_LT(spectral_radius(hand, there, 1.01 * *least_kg), 1.0) << k;
    }
    EXPECT_GE(spectral_radius(hand, there, 0.9 * free_kg), 1.0) << k;
  }
}

TEST(LayerTouch, AcrossWhereAnArmCanGoChangesNothing) {
  const description::Cell cell = description::load_cell(source_file("models/cells/linear.yaml"));
  const LoopModel loop = loop_of(cell, 1e-3);
  const HandModel hand{500.0, 20.0, 1.0};
  LayerTouch across = layer_along(Vec3::UnitZ(), 50000.0);
  const double free_kg = *smallest_stable_mass(hand, loop);
  EXPECT_EQ(*smallest_stable_mass(hand, on_layers(loop, {across})), free_kg);
  across.sticks_along_W = Vec3::UnitZ();
  EXPECT_EQ(*smallest_stable_mass(hand, on_layers(loop, {across})), free_kg);
}

TEST(LayerTouch, TheOneThatAsksForMostIsNamedInARefusal) {
  const description::Cell cell = description::load_cell(source_file("models/cells/default.yaml"));
  LoopModel loop = loop_of(cell, 1e-3);
  const HandModel hand{399.2, 12.3, 1.91};
  const Vec3 n = Vec3(-0.3277, -0.6618, 0.6743).normalized();
  LayerTouch soft = layer_along(n, 100.0), hard = layer_along(n, 61254.0);
  soft.what = "layer 'cushion' of 100 N/m";
  hard.what = "layer 'foam' of 61.3 kN/m";
  const double free_kg = *smallest_stable_mass(hand, loop);
  EXPECT_FALSE(decisive_layer(hand, loop));
  loop = on_layers(loop, {soft, hard});
  const auto limit = decisive_layer(hand, loop);
  ASSERT_TRUE(limit);
  EXPECT_EQ(limit->what, hard.what);
  EXPECT_GT(*limit->mass_kg, free_kg);
  try {
    require_stable_mass(*limit->mass_kg / 1.01 + loop.handle_mass_kg, hand, loop, false);
    ADD_FAILURE() << "accepted";
  } catch (const description::SetupError& error) {
    EXPECT_NE(std::string(error.what()).find("on layer 'foam' of 61.3 kN/m"), std::string::npos) << error.what();
  }
}

TEST(ElasticLoop, DrivesWithoutALagAreStableToo) {
  const description::Cell cell = description::load_cell(source_file("models/cells/default.yaml"));
  LoopModel loop = loop_of(cell, 1e-3);
  loop.drive_time_constant_s = 0.0;
  EXPECT_LT(spectral_radius({500.0, 20.0, 1.0}, loop, 10.0), 1.0);
  loop.order = 2;
  EXPECT_LT(spectral_radius({500.0, 20.0, 1.0}, loop, 10.0), 1.0);
  loop.horizon_s = 4e-3;
  EXPECT_LT(spectral_radius({500.0, 20.0, 1.0}, loop, 20.0), 1.0);
}

}  // namespace
}  // namespace proxarm::controller
