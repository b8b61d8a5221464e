// The project's own master against the simulated devices, over the in-process buses: two independent readings of the
// standards meet here.
#include <chrono>
#include <cmath>
#include <filesystem>
#include <functional>

#include "fieldbus/canopen/canopen_heartbeat.hpp"
#include "fieldbus/cia402/cia402_bring_up.hpp"
#include "fieldbus/cia402/cia402_goodbye.hpp"
#include "fieldbus/sensors/ati_net_can_oem.hpp"
#include "fieldbus/simulated/simulated_can_network.hpp"
#include "models/base/setup_error.hpp"
#include "sim/cell/simulated_cell.hpp"
#include "tests/allocation_count.hpp"
#include "tests/sim/devices/device_harness.hpp"
#include "tests/source_file.hpp"

namespace proxarm::sim {
namespace {

using ::testing::HasSubstr;
using testing::ms;

const std::filesystem::path source = source_file();

struct MasterAndDrives : ::testing::Test {
  void start(const std::vector<std::string>& faults = {}) {
    network = std::make_unique<fieldbus::SimulatedCanNetwork>(simulated_buses(cell));
    SimulatedCellConfig config;
    for (const auto& text : faults) config.faults.push_back(parse_device_fault(text));
    const auto sensor = description::load_sensor(source / "models/sensors/ati_net_can_oem.yaml");
    far_end = std::make_unique<SimulatedCell>(cell, sensor, description::HandDescription{}, network->events(), config);
    far_end->attach_to(*network);
    far_end->power_on();
    for (const auto& drive : cell.drives) drives.emplace_back(drive, fieldbus::DriveSettings{});
    for (std::size_t i = 0; i < drives.size(); ++i) slots.push_back({&drives[i], i < 3 ? std::size_t{0} : 1});
  }
  std::string failure() {
    try {
      fieldbus::bring_up_drives(*network, slots);
    } catch (const description::SetupError& error) {
      return error.what();
    }
    return "";
  }
  // One cycle of 1 ms as the master's users run it.
  void cycle(const std::function<void(std::size_t, const fieldbus::CanFrame&)>& other = {}) {
    const std::int64_t t = network->now_ns();
    for (std::size_t bus = 0; bus < 2; ++bus) {
      network->bus(bus).send(testing::from_text("080#"));
      if (++heartbeats % 20 == 0 || heartbeats % 20 == 1) network->bus(bus).send(testing::from_text("77F#05"));
    }
    for (auto& drive : drives) drive.on_sync(t);
    network->sleep_until(t + 450'000);
    for (std::size_t bus = 0; bus < 3; ++bus) {
      for (fieldbus::TimedFrame timed; network->bus(bus).receive(timed);) {
        for (const auto& slot : slots) {
          if (slot.bus == bus) slot.drive->on_frame(timed.frame, timed.time_ns);
        }
        if (other) other(bus, timed.frame);
      }
    }
    for (const auto& slot : slots) {
      if (!slot.drive->fresh()) ++missing;
      if (slot.drive->following()) slot.drive->set_target_rad(slot.drive->target_rad() + step_rad);
      fieldbus::CanFrame frame;
      if (slot.drive->encode_rpdo(frame)) network->bus(slot.bus).send(frame);
    }
    network->sleep_until(t + ms);
  }

  // As the cycle's owner does it after the last cycle.
  void say_goodbye() {
    fieldbus::Goodbye goodbye(slots);
    goodbye.begin(network->now_ns());
    while (!goodbye.done(network->now_ns())) {
      fieldbus::CanFrame frame;
      for (std::size_t bus = 0; goodbye.next_request(network->now_ns(), bus, frame);) network->bus(bus).send(frame);
      cycle([&](std::size_t bus, const fieldbus::CanFrame& said) { (void)goodbye.on_frame(bus, said); });
    }
  }

  description::Cell cell = description::load_cell(source / "models/cells/default.yaml");
  std::unique_ptr<fieldbus::SimulatedCanNetwork> network;
  std::unique_ptr<SimulatedCell> far_end;
  std::vector<fieldbus::ServoDrive> drives;
  std::vector<fieldbus::DriveSlot> slots;
  int heartbeats = 0, missing = 0;
  double step_rad = 0.0;
};

// Interpolated position (mode 7): targets in 60C1h:01, valid while controlword bit 4 is set.
TEST_F(MasterAndDrives, MoveInInterpolatedPositionMode) {
  for (auto& drive : cell.drives) drive.mode = "ip";
  start();
  ASSERT_EQ(failure(), "");
  for (auto& drive : drives) drive.request(fieldbus::DriveGoal::operation_enabled);
  for (int i = 0; i < 200; ++i) cycle();
  EXPECT_EQ(far_end->drive(0).canopen().dictionary().number(0x6061), 7);
  EXPECT_EQ(far_end->drive(0).canopen().dictionary().number(0x6040), 0x1F);
  step_rad = 1e-4;
  const double before = far_end->plant().arm().joint_angle_rad(0);
  for (int i = 0; i < 500; ++i) cycle();
  step_rad = 0.0;
  for (int i = 0; i < 300; ++i) cycle();
  EXPECT_NEAR(far_end->plant().arm().joint_angle_rad(0) - before, 0.05, 1e-3);
  for (auto& drive : drives) EXPECT_EQ(drive.fault(), fieldbus::DriveFault::none) << drive.describe();
}

TEST_F(MasterAndDrives, ComeUpTogetherMoveAndSwitchOff) {
  start();
  ASSERT_EQ(failure(), "");
  for (auto& drive : drives) drive.request(fieldbus::DriveGoal::operation_enabled);
  for (int i = 0; i < 200; ++i) cycle();
  for (auto& drive : drives) EXPECT_TRUE(drive.following()) << drive.describe();
  EXPECT_TRUE(far_end->plant().hand_started());
  step_rad = 1e-4;
  missing = 0;
  const double before = far_end->plant().arm().joint_angle_rad(0);
  for (int i = 0; i < 500; ++i) cycle();
  EXPECT_EQ(missing, 0);
  step_rad = 0.0;
  for (int i = 0; i < 300; ++i) cycle();
  EXPECT_NEAR(far_end->plant().arm().joint_angle_rad(0) - before, 0.05, 1e-3);
  for (auto& drive : drives) EXPECT_EQ(drive.fault(), fieldbus::DriveFault::none) << drive.describe();
  for (auto& drive : drives) drive.request(fieldbus::DriveGoal::switched_off);
  for (int i = 0; i < 200; ++i) cycle();
  for (std::size_t i = 0; i < drives.size(); ++i) EXPECT_EQ(far_end->drive(i).state(), DriveState::switch_on_disabled);
  fieldbus::leave_operational(*network, slots);
  network->sleep_until(network->now_ns() + 10 * ms);
  for (std::size_t i = 0; i < drives.size(); ++i) {
    EXPECT_EQ(far_end->drive(i).canopen().state(), NmtState::pre_operational);
  }
}

// Every clean end left an EMCY 8130h of each drive: the heartbeat had ended, and they still waited for it.
TEST_F(MasterAndDrives, AreLeftWithoutAWordOfAFaultWhenTheyWereOffAndStopByThemselvesWhenNot) {
  for (const bool off_first : {true, false}) {
    drives.clear();
    slots.clear();
    start();
    ASSERT_EQ(failure(), "");
    for (auto& drive : drives) drive.request(fieldbus::DriveGoal::operation_enabled);
    for (int i = 0; i < 200; ++i) cycle();
    if (off_first) {
      for (auto& drive : drives) drive.request(fieldbus::DriveGoal::switched_off);
      for (int i = 0; i < 200; ++i) cycle();
    }
    say_goodbye();
    fieldbus::leave_operational(*network, slots);
    network->sleep_until(network->now_ns() + 500 * ms);
    int emergencies = 0;
    fieldbus::TimedFrame received;
    for (std::size_t bus = 0; bus < network->bus_count(); ++bus) {
      while (network->bus(bus).receive(received)) emergencies += received.frame.id > 0x080 && received.frame.id < 0x100;
    }
    EXPECT_EQ(emergencies, off_first ? 0 : static_cast<int>(drives.size()));
    for (std::size_t i = 0; i < drives.size(); ++i) {
      EXPECT_NE(far_end->drive(i).state(), DriveState::operation_enabled) << i;
    }
  }
}

// Everything at the far end lives inside the controller's calls to wait: it must not allocate there once it runs.
TEST_F(MasterAndDrives, AllocateNothingInSteadyMotion) {
  start();
  ASSERT_EQ(failure(), "");
  for (auto& drive : drives) drive.request(fieldbus::DriveGoal::operation_enabled);
  step_rad = 1e-5;
  for (int i = 0; i < 500; ++i) cycle();
  const std::uint64_t before = tests::allocation_count();
  for (int i = 0; i < 500; ++i) cycle();
  EXPECT_EQ(tests::allocation_count() - before, 0u);
}

TEST_F(MasterAndDrives, SayWhichDriveDoesNotAnswer) {
  start({"axis_5:silent"});
  EXPECT_THAT(failure(), HasSubstr("node 5"));
}

TEST_F(MasterAndDrives, SayWhichDriveIsAnotherDevice) {
  start({"axis_2:device_type=0x00030191"});
  EXPECT_THAT(failure(), ::testing::AllOf(HasSubstr("node 2"), HasSubstr("1000h"), HasSubstr("0x00030191")));
}

TEST_F(MasterAndDrives, TheDrivesStopByThemselvesWhenTheMasterDies) {
  start();
  ASSERT_EQ(failure(), "");
  for (auto& drive : drives) drive.request(fieldbus::DriveGoal::operation_enabled);
  for (int i = 0; i < 200; ++i) cycle();
  step_rad = 3e-4;
  for (int i = 0; i < 300; ++i) cycle();
  // At 0.3 rad/s the quick-stop ramps of 30 rad/s² and more need 10 ms and 1.5 mrad; the five periods of the PDO's
  // timer come before it, and the servo loop slows down a quarter of a period after the last target anyway.
  std::vector<double> then;
  for (std::size_t i = 0; i < 6; ++i) then.push_back(far_end->plant().arm().motor_angle_rad(i));
  network->sleep_until(network->now_ns() + 100 * ms);
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_NE(far_end->drive(i).state(), DriveState::operation_enabled) << i;
    EXPECT_FALSE(far_end->plant().servo(i).powered()) << i;
    EXPECT_NEAR(far_end->plant().arm().motor_angle_rad(i), then[i], 5e-3) << i;
  }
}

TEST_F(MasterAndDrives, TheSensorsMatrixComesOverTheWireUnchanged) {
  start();
  fieldbus::AtiNetCanOem master({.bus_name = "sensor", .base_id = 0x68});
  master.start(*network, 2);
  const auto& simulation = description::load_sensor(source / "models/sensors/ati_net_can_oem.yaml").simulation;
  for (std::size_t row = 0; row < 6; ++row) {
    for (std::size_t column = 0; column < 6; ++column) {
      EXPECT_EQ(static_cast<float>(master.matrix()[row][column]), static_cast<float>(simulation.matrix[row][column]));
    }
  }
  EXPECT_EQ(master.counts_per_unit()[0], simulation.counts_per_N);
}

TEST_F(MasterAndDrives, ASilentSensorIsNoticedAtStart) {
  start({"sensor:silent"});
  fieldbus::AtiNetCanOem master({.bus_name = "sensor", .base_id = 0x68});
  EXPECT_THROW(master.start(*network, 2), description::SetupError);
}

}  // namespace
}  // namespace proxarm::sim
