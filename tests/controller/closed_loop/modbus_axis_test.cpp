// A cell whose first axis is a rail on Modbus under an arm on CAN, against its simulated far end: it runs, and whatever
// happens to the line stops all axes in a controlled way.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>

#include "tests/controller/closed_loop/closed_loop_rig.hpp"

namespace proxarm::controller {
namespace {

using testing::ClosedLoopRig;
using testing::RigOptions;

RigOptions rail(std::vector<std::string> faults = {}) {
  RigOptions options;
  options.device_faults = std::move(faults);
  options.cell = "models/cells/rail.yaml";
  options.settings.mass_kg = 8.0;
  return options;
}

double rail_m(const CycleRecord& record, const ClosedLoopRig& rig) {
  return record.actual_counts[0] / rig.cell.drives[0].counts_per_rad();
}

TEST(ModbusAxis, RunsUnderAnArmOnCan) {
  ClosedLoopRig rig(rail());
  rig.run();
  EXPECT_EQ(rig.fault().fault, Fault::none) << describe(rig.fault(), rig.cycle->parts().drives[0].drive.describe());
  EXPECT_EQ(rig.cycle->rendered_cycles(), 2500u);
  EXPECT_NEAR(rig.cycle->parts().modbus_lines[0]->drives()[0]->achieved_rate_Hz(), 200.0, 1.0);
  EXPECT_EQ(rig.far_end.modbus_drive(0).register_at(16) & 2, 0) << "switched off in the end";
}

// The rail carries what goes along y: 0.15 m in 1.5 s through free space.
std::string sideways_hand() {
  const std::string hand = ::testing::TempDir() + "sideways.yaml";
  std::ofstream(hand) << "name: sideways\nmass_kg: 1.0\nstiffness_N_per_m: 500\ndamping_Ns_per_m: 20\nwaypoints:\n"
                         "  - {time_s: 0.3, offset_m: [0, 0, 0]}\n  - {time_s: 1.8, offset_m: [0, 0.15, 0]}\n";
  return hand;  // absolute: replaces the folder of the sources
}

TEST(ModbusAxis, FollowsASidewaysMotion) {
  RigOptions options = rail();
  options.scene = "scenes/free.yaml";
  options.hand = sideways_hand();
  ClosedLoopRig rig(options);
  rig.run();
  ASSERT_EQ(rig.fault().fault, Fault::none) << describe(rig.fault(), rig.cycle->parts().drives[0].drive.describe());
  double worst_m = 0.0, fastest_m_per_s = 0.0;
  for (std::size_t k = 1; k < rig.records.size(); ++k) {
    if (rig.records[k].phase != Phase::rendering || rig.records[k - 1].phase != Phase::rendering) continue;
    const double per_m = rig.cell.drives[0].counts_per_rad();
    const double target_m = rig.records[k].target_counts[0] / per_m;
    const double target_k1_m = rig.records[k - 1].target_counts[0] / per_m;
    worst_m = std::max(worst_m, std::abs(target_m - rail_m(rig.records[k], rig)));
    fastest_m_per_s = std::max(fastest_m_per_s, std::abs(target_m - target_k1_m) / 1e-3);
  }
  EXPECT_GT(rail_m(rig.records.back(), rig), 0.1) << "m";
  // Two periods of 1 ms to where the setpoint is meant, an exchange of 5 ms that it waits for, another for the answer,
  // and the servo's own lag of at most 10 ms.
  EXPECT_LT(worst_m, 0.022 * fastest_m_per_s);
}

// The rail jams in the middle of that motion, is pushed on for 0.4 s and comes free: it snapped by 0.84 m/s when only
// the leash held it.
TEST(ModbusAxis, WindsNothingUpBehindAJammedRail) {
  RigOptions options = rail({"rail:jammed@1.3s..1.7s"});
  options.scene = "scenes/free.yaml";
  options.hand = sideways_hand();
  options.duration_s = 3.5;
  ClosedLoopRig rig(options);
  rig.run();
  EXPECT_EQ(rig.fault().fault, Fault::none) << fault_name(rig.fault().fault);
  double fastest_m_per_s = 0.0, furthest_m = 0.0;
  std::size_t waited = 0;
  for (std::size_t k = 0; k < rig.records.size(); ++k) {
    if (rig.records[k].phase != Phase::rendering) continue;
    fastest_m_per_s = std::max(fastest_m_per_s, rig.truths[k].velocity_W.norm());
    furthest_m = std::max(furthest_m, (vec3(rig.records[k].proxy_W_m) - vec3(rig.records[k].tool_W_m)).norm());
    waited += rig.records[k].has(RecordFlag::limit_following_error) ? 1 : 0;
  }
  std::printf("tip %.3f m/s, proxy to tool %.2f mm, waited %zu cycles\n", fastest_m_per_s, 1e3 * furthest_m, waited);
  EXPECT_LT(fastest_m_per_s, rig.cell.limits.max_tool_speed_m_per_s);
  EXPECT_LE(furthest_m, rig.cell.limits.leash_m + 1e-6);
  EXPECT_GT(waited, 150u);
  EXPECT_GT(rail_m(rig.records.back(), rig), 0.1) << "m: it went on";
}

struct LineFault {
  const char* script;
  Fault named;
  fieldbus::DriveFault fault;
  std::size_t most_cycles;  // from the failure to the stop: one exchange of 5 ms, or the 60 ms of stale_after_s
  const char* message;
};

class ModbusLineFaults : public ::testing::TestWithParam<LineFault> {};

TEST_P(ModbusLineFaults, StopAllAxes) {
  ClosedLoopRig rig(rail({std::string("rail:") + GetParam().script + "@1.9s"}));
  rig.run();
  ASSERT_EQ(rig.fault().fault, GetParam().named) << fault_name(rig.fault().fault);
  EXPECT_EQ(rig.fault().where, 0);
  const fieldbus::CyclicDrive& drive = rig.cycle->parts().drives[0].drive;
  EXPECT_EQ(drive.fault(), GetParam().fault) << drive.describe();
  EXPECT_THAT(drive.describe(), ::testing::HasSubstr(GetParam().message));
  EXPECT_LE(rig.fault().cycle, rig.cycle_at(1.9) + GetParam().most_cycles);
  EXPECT_EQ(rig.cycle->supervisor().phase(), Phase::done);
  // The arm on CAN ran out and is switched off; the rail's drive has stopped by its own communication timeout or its
  // control word. Nothing moves.
  for (std::size_t axis = 1; axis < 6; ++axis) {
    EXPECT_NE(rig.far_end.drive(axis).state(), sim::DriveState::operation_enabled);
  }
  const auto first = static_cast<std::size_t>(rig.fault().cycle);
  const sim::Truth last = rig.far_end.truth();
  EXPECT_LT((last.X_WT.translation() - rig.truths[first].X_WT.translation()).norm(), 0.02);
  EXPECT_LT(last.velocity_W.norm(), 2e-3);
}

INSTANTIATE_TEST_SUITE_P(
    Faults, ModbusLineFaults,
    ::testing::Values(
        LineFault{"exception=4", Fault::drive_fault, fieldbus::DriveFault::modbus_exception, 8,
                  "server device failure"},
        LineFault{"closed", Fault::modbus_silent, fieldbus::DriveFault::modbus_closed, 8, "connection was closed"},
        LineFault{"wrong_unit", Fault::drive_fault, fieldbus::DriveFault::modbus_wrong_unit, 8, "another unit"},
        LineFault{"silent", Fault::modbus_silent, fieldbus::DriveFault::modbus_timeout, 70,
                  "no complete Modbus answer in time"},
        LineFault{"half_answer", Fault::modbus_silent, fieldbus::DriveFault::modbus_timeout, 70,
                  "no complete Modbus answer in time"}),
    [](const auto& fault) {
      const std::string script = fault.param.script;
      return script.substr(0, script.find('='));
    });

}  // namespace
}  // namespace proxarm::controller
