// The master's drives and sensor against the simulated ones, on buses with real bit timing. Master and peers were
// written apart from each other, so that a misreading of the standards on one side shows here.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include "fieldbus/canopen/canopen_sync.hpp"
#include "fieldbus/cia402/cia402_bring_up.hpp"
#include "fieldbus/cia402/cia402_goodbye.hpp"
#include "fieldbus/sensors/ati_net_can_oem.hpp"
#include "fieldbus/simulated/simulated_can_network.hpp"
#include "models/base/setup_error.hpp"
#include "models/description/cell.hpp"
#include "models/description/hand.hpp"
#include "models/description/sensor.hpp"
#include "sim/cell/simulated_cell.hpp"
#include "tests/source_file.hpp"

namespace proxarm::fieldbus {
namespace {

constexpr std::int64_t ms = 1'000'000;
const std::filesystem::path source_dir = source_file();

// The default cell with its simulated far end, and the master's side as the cycle uses it.
struct SimulatedDrives : ::testing::Test {
  description::Cell cell = description::load_cell(source_dir / "models/cells/default.yaml");
  description::HandDescription hand{};
  DriveSettings settings;
  std::unique_ptr<SimulatedCanNetwork> network;
  std::unique_ptr<sim::SimulatedCell> far_end;
  std::vector<ServoDrive> drives;
  std::vector<DriveSlot> slots;
  std::vector<std::size_t> drive_buses;
  std::unique_ptr<AtiNetCanOem> sensor;
  std::size_t sensor_bus = 0;
  SyncProducer sync;
  HeartbeatProducer heartbeat{127, 20 * ms};
  std::uint64_t cycles = 0;
  std::int64_t t_ns = 0;
  bool poll_sensor = false;

  void build(std::vector<sim::DeviceFault> faults = {}) {
    network = std::make_unique<SimulatedCanNetwork>(sim::simulated_buses(cell));
    const auto sensor_file = description::load_sensor(source_dir / "models/sensors/ati_net_can_oem.yaml");
    sim::SimulatedCellConfig config;
    config.faults = std::move(faults);
    far_end = std::make_unique<sim::SimulatedCell>(cell, sensor_file, hand, network->events(), config);
    far_end->attach_to(*network);
    far_end->power_on();
    const auto bus_index = [this](const std::string& name) {
      const auto bus =
          std::find_if(cell.buses.begin(), cell.buses.end(), [&](const auto& b) { return b.name == name; });
      return static_cast<std::size_t>(bus - cell.buses.begin());
    };
    for (const auto& drive : cell.drives) drives.emplace_back(drive, settings);
    for (ServoDrive& drive : drives) {
      slots.push_back({&drive, bus_index(drive.description().bus)});
      if (std::find(drive_buses.begin(), drive_buses.end(), slots.back().bus) == drive_buses.end()) {
        drive_buses.push_back(slots.back().bus);
      }
    }
    sensor_bus = bus_index(cell.sensor.bus);
    sensor = std::make_unique<AtiNetCanOem>(
        AtiNetCanOemSettings{.bus_name = cell.sensor.bus, .base_id = cell.sensor.base_id});
  }

  void bring_up() {
    sensor->start(*network, sensor_bus);
    bring_up_drives(*network, slots);
    t_ns = network->now_ns() + ms;
  }

  // One period, as run_cycle() has it.
  template <typename Targets>
  void cycle(Targets&& targets) {
    network->sleep_until(t_ns);
    CanFrame frame;
    const bool beat = heartbeat.due(t_ns, cycles, frame);
    for (const std::size_t bus : drive_buses) {
      network->bus(bus).send(sync.next());
      if (beat) network->bus(bus).send(frame);
    }
    for (ServoDrive& drive : drives) drive.on_sync(t_ns);
    if (poll_sensor && sensor->poll(t_ns, frame)) network->bus(sensor_bus).send(frame);
    const std::int64_t window_ns = t_ns + settings.period_ns * 45 / 100;
    const auto all_in = [this] {
      return std::all_of(drives.begin(), drives.end(), [](const ServoDrive& drive) { return drive.fresh(); }) &&
             (!poll_sensor || sensor->fresh());
    };
    do {
      TimedFrame received;
      for (std::size_t bus = 0; bus < network->bus_count(); ++bus) {
        while (network->bus(bus).receive(received)) {
          bool taken = bus == sensor_bus && sensor->on_frame(received.frame, received.time_ns);
          for (const DriveSlot& slot : slots) {
            taken = taken || (slot.bus == bus && slot.drive->on_frame(received.frame, received.time_ns));
          }
        }
      }
    } while (!all_in() && network->wait_for_frame(window_ns));
    targets();
    for (const DriveSlot& slot : slots) {
      if (slot.drive->encode_rpdo(frame)) network->bus(slot.bus).send(frame);
    }
    ++cycles;
    t_ns += settings.period_ns;
  }
  void cycle() {
    cycle([] {});
  }
  // Where the drive's encoder really is now.
  [[nodiscard]] std::int32_t position(std::size_t i) {
    return static_cast<std::int32_t>(far_end->drive(i).canopen().dictionary().number(0x6064));
  }
  [[nodiscard]] bool all_following() const {
    return std::all_of(drives.begin(), drives.end(), [](const ServoDrive& drive) { return drive.following(); });
  }
  void enable() {
    for (ServoDrive& drive : drives) drive.request(DriveGoal::operation_enabled);
    for (int i = 0; i < 500 && !all_following(); ++i) cycle();
    for (const ServoDrive& drive : drives) ASSERT_TRUE(drive.following()) << drive.describe();
  }
  void expect_no_faults() const {
    for (const ServoDrive& drive : drives) EXPECT_EQ(drive.fault(), DriveFault::none) << drive.describe();
  }
};

TEST_F(SimulatedDrives, AreBroughtUpEnabledMovedAndSwitchedOff) {
  build();
  bring_up();
  EXPECT_LT(network->now_ns(), 400 * ms) << "six drives side by side";
  RecordProperty("bring_up_ms", static_cast<int>(network->now_ns() / ms));
  enable();
  expect_no_faults();
  std::vector<double> begin_rad;
  for (const ServoDrive& drive : drives) begin_rad.push_back(drive.target_rad());
  for (std::size_t i = 0; i < drives.size(); ++i) EXPECT_NEAR(drives[i].actual_rad(), cell.start_rad[i], 2e-3);

  // Each axis out and back by 0.02 rad in a second: 1 − cos, so it starts and ends at rest.
  double worst_rad = 0.0;
  for (int k = 0; k < 1000; ++k) {
    const double way_rad = 0.01 * (1.0 - std::cos(2.0 * std::numbers::pi * k * 1e-3));
    cycle([&] {
      for (std::size_t i = 0; i < drives.size(); ++i) {
        worst_rad = std::max(worst_rad, std::abs(drives[i].actual_rad() - drives[i].target_rad()));
        ASSERT_TRUE(drives[i].fresh()) << drives[i].describe();
        ASSERT_TRUE(drives[i].set_target_rad(begin_rad[i] + way_rad));
      }
    });
  }
  expect_no_faults();
  EXPECT_LT(worst_rad, 2e-3) << "actual against target, delays of the cycle included";

  for (ServoDrive& drive : drives) drive.request(DriveGoal::switched_off);
  for (int k = 0; k < 100; ++k) cycle();
  for (const ServoDrive& drive : drives) EXPECT_EQ(drive.state(), DriveState::switch_on_disabled) << drive.describe();
  leave_operational(*network, slots);
  network->sleep_until(network->now_ns() + 10 * ms);
  for (std::size_t i = 0; i < drives.size(); ++i) {
    EXPECT_EQ(far_end->drive(i).canopen().state(), sim::NmtState::pre_operational);
  }
}

TEST_F(SimulatedDrives, DoNotJumpWhileTheyAreEnabled) {
  build();
  bring_up();
  std::vector<std::int32_t> begin(drives.size());
  for (std::size_t i = 0; i < drives.size(); ++i) begin[i] = drives[i].scale().counts(cell.start_rad[i]).value();
  for (ServoDrive& drive : drives) drive.request(DriveGoal::operation_enabled);
  double worst_rad = 0.0;
  for (int k = 0; k < 500; ++k) {
    cycle();
    for (std::size_t i = 0; i < drives.size(); ++i) {
      if (drives[i].heard()) worst_rad = std::max(worst_rad, std::abs(drives[i].actual_rad() - cell.start_rad[i]));
    }
  }
  EXPECT_TRUE(all_following());
  // The links hang in their gears (gravity over gear stiffness) and the loop takes the load over: no more than that.
  EXPECT_LT(worst_rad, 2e-3);
}

TEST_F(SimulatedDrives, StopByThemselvesWhenTheControllerDies) {
  build();
  bring_up();
  enable();
  std::vector<double> begin_rad;
  for (const ServoDrive& drive : drives) begin_rad.push_back(drive.target_rad());
  // Up to 0.2 rad/s in 100 ms, and on at that speed.
  constexpr double speed = 0.2, ramp_s = 0.1;
  for (int k = 0; k < 200; ++k) {
    const double t = k * 1e-3;
    const double way_rad = t < ramp_s ? 0.5 * speed * t * t / ramp_s : speed * (t - 0.5 * ramp_s);
    cycle([&] {
      for (std::size_t i = 0; i < drives.size(); ++i) drives[i].set_target_rad(begin_rad[i] + way_rad);
    });
  }
  expect_no_faults();
  // Killed between two frames: the last target is latched by nobody, since there is no SYNC any more.
  const std::int64_t death_ns = network->now_ns();
  std::vector<double> death_rad;
  for (std::size_t i = 0; i < drives.size(); ++i) death_rad.push_back(drives[i].scale().angle_rad(position(i)));
  // RPDO timeout (5 periods) or three missing SYNCs, whichever the drive notices first, then its quick-stop ramp at
  // max_acceleration; a tick of the drive's clock (1 ms) and a period of interpolation on top, and 30 ms for the
  // elastic gears to swing out.
  for (std::int64_t after_ns = 0; after_ns < 60 * ms; after_ns += ms) {
    network->sleep_until(death_ns + after_ns);
    for (std::size_t i = 0; i < drives.size(); ++i) {
      const double ramp_rad = speed * speed / (2.0 * cell.drives[i].max_acceleration_rad_per_s2);
      const double way_rad = drives[i].scale().angle_rad(position(i)) - death_rad[i];
      ASSERT_LT(way_rad, speed * 7e-3 + ramp_rad + 1e-3) << "drive " << i << " after " << after_ns / ms << " ms";
    }
  }
  for (std::size_t i = 0; i < drives.size(); ++i) {
    EXPECT_NE(far_end->drive(i).state(), sim::DriveState::operation_enabled) << "drive " << i;
  }
}

TEST_F(SimulatedDrives, StopWhenOnlyTheCycleHangs) {
  build();
  bring_up();
  enable();
  // The program lives on, and something of it keeps SYNC running, but no target comes: the RPDO timer ends it.
  for (int k = 0; k < 50; ++k) {
    network->sleep_until(t_ns);
    for (const std::size_t bus : drive_buses) network->bus(bus).send(sync.next());
    t_ns += ms;
  }
  for (std::size_t i = 0; i < drives.size(); ++i) {
    EXPECT_NE(far_end->drive(i).state(), sim::DriveState::operation_enabled) << "drive " << i;
  }
}

TEST_F(SimulatedDrives, ResetOrStoppedBySomeoneElseAreNoticed) {
  for (const NmtCommand command : {NmtCommand::enter_pre_operational, NmtCommand::stop, NmtCommand::reset_node}) {
    SCOPED_TRACE(static_cast<int>(command));
    drives.clear();
    slots.clear();
    drive_buses.clear();
    heartbeat = HeartbeatProducer{127, 20 * ms};
    build();
    bring_up();
    enable();
    network->bus(1).send(nmt_frame(command, 4));  // as a second master would
    for (int k = 0; k < 200 && drives[3].fault() == DriveFault::none; ++k) cycle();
    // Seen in its heartbeat, its boot-up message, or in that it left operation; always within a heartbeat's time-out.
    EXPECT_NE(drives[3].fault(), DriveFault::none);
    for (const std::size_t other : {0U, 1U, 2U, 4U, 5U}) EXPECT_EQ(drives[other].fault(), DriveFault::none);
    for (int k = 0; k < 100; ++k) cycle();
    EXPECT_NE(far_end->drive(3).state(), sim::DriveState::operation_enabled);
  }
}

TEST_F(SimulatedDrives, CutOffIsNoticedByItsSilence) {
  build();
  bring_up();
  enable();
  far_end->node(1).cut(true);
  for (int k = 0; k < 3; ++k) cycle();
  EXPECT_EQ(drives[1].cycles_without_tpdo(), 2U) << "the third is only over at the next SYNC";
  EXPECT_FALSE(drives[1].fresh());
  for (int k = 0; k < 200; ++k) cycle();
  EXPECT_EQ(drives[1].fault(), DriveFault::heartbeat_lost);
}

TEST_F(SimulatedDrives, AreTakenOverByTheNextControllerAfterOneDied) {
  build();
  bring_up();
  enable();
  network->sleep_until(network->now_ns() + 500 * ms);  // dead for half a second: the drives have faulted
  drives.clear();
  slots.clear();
  for (const auto& drive : cell.drives) drives.emplace_back(drive, settings);
  std::size_t i = 0;
  for (ServoDrive& drive : drives) slots.push_back({&drive, i++ < 3 ? 0U : 1U});
  heartbeat = HeartbeatProducer{127, 20 * ms};
  bring_up();
  enable();
  expect_no_faults();
}

TEST_F(SimulatedDrives, AFaultOfOneIsSeenWithItsEmergency) {
  build();
  bring_up();
  enable();
  far_end->drive(2).inject_fault(0x4210, network->now_ns());
  for (int k = 0; k < 5; ++k) cycle();
  EXPECT_NE(drives[2].fault(), DriveFault::none);
  EXPECT_EQ(drives[2].latest_emergency().code, 0x4210);
  EXPECT_NE(drives[2].describe().find("EMCY 4210: excess temperature of the device"), std::string::npos)
      << drives[2].describe();
  for (const std::size_t other : {0U, 1U, 3U, 4U, 5U}) EXPECT_EQ(drives[other].fault(), DriveFault::none);
}

TEST_F(SimulatedDrives, AnotherDeviceAtANodeIsRefused) {
  build({sim::parse_device_fault("axis_2:device_type=0x00030191")});
  try {
    bring_up();
    FAIL() << "brought up";
  } catch (const description::SetupError& error) {
    EXPECT_EQ(error.node(), 2);
    EXPECT_NE(std::string(error.what()).find("found 0x00030191"), std::string::npos) << error.what();
  }
}

TEST_F(SimulatedDrives, TheSensorIsReadOncePerPoll) {
  build();
  bring_up();
  poll_sensor = true;
  for (int k = 0; k < 200; ++k) {
    cycle();
    ASSERT_TRUE(sensor->fresh()) << "cycle " << k;
    ASSERT_TRUE(sensor->latest().healthy);
    ASSERT_FALSE(sensor->latest().saturated);
  }
  EXPECT_EQ(sensor->dropped_frames(), 0U);
  EXPECT_EQ(sensor->wrong_lengths(), 0U);
}

TEST_F(SimulatedDrives, AFaultySensorIsNeverMisread) {
  struct Case {
    const char* fault;
    bool fresh;  // whether samples still come
  };
  for (const Case& c : {Case{"sensor:half@1s", false}, Case{"sensor:swapped@1s", false}, Case{"sensor:short@1s", false},
                        Case{"sensor:duplicated@1s", true}, Case{"sensor:silent@1s", false},
                        Case{"sensor:samples@1s", false}, Case{"sensor:frozen@1s", true}}) {
    SCOPED_TRACE(c.fault);
    drives.clear();
    slots.clear();
    drive_buses.clear();
    build({sim::parse_device_fault(c.fault)});
    sensor->start(*network, sensor_bus);
    poll_sensor = true;
    network->sleep_until(1100 * ms);
    t_ns = network->now_ns() + ms;
    for (int k = 0; k < 50; ++k) {
      cycle();
      EXPECT_EQ(sensor->fresh(), c.fresh) << "cycle " << k;
    }
    if (std::string(c.fault).find("frozen") != std::string::npos) {
      EXPECT_GE(sensor->latest().repeats, 40U);
    }
  }
}

}  // namespace
}  // namespace proxarm::fieldbus
