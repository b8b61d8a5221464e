// The default cell's far end on the in-process buses, with a master whose frames are typed by hand.
#include "sim/cell/simulated_cell.hpp"

#include <cmath>
#include <ctime>
#include <filesystem>

#include "fieldbus/simulated/simulated_can_network.hpp"
#include "models/base/setup_error.hpp"
#include "tests/sim/devices/device_harness.hpp"
#include "tests/source_file.hpp"

namespace proxarm::sim {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::ms;

const std::filesystem::path source = source_file();

// A hand that holds still, or one that pushes along x.
description::HandDescription still_hand() {
  description::HandDescription hand;
  hand.mass_kg = 1.0;
  return hand;
}

class SimulatedCellTest : public ::testing::Test {
 protected:
  SimulatedCellTest() : cell(description::load_cell(source / "models/cells/default.yaml")) {
    sensor = description::load_sensor(source / "models/sensors/ati_net_can_oem.yaml");
  }
  void start(const std::vector<std::string>& faults = {}) {
    network = std::make_unique<fieldbus::SimulatedCanNetwork>(simulated_buses(cell));
    SimulatedCellConfig config;
    for (const auto& text : faults) config.faults.push_back(parse_device_fault(text));
    far_end = std::make_unique<SimulatedCell>(cell, sensor, still_hand(), network->events(), config);
    far_end->attach_to(*network);
    far_end->power_on();
  }
  void send(std::size_t bus, const std::string& text) {
    ASSERT_EQ(network->bus(bus).send(testing::from_text(text)), fieldbus::SendResult::sent);
  }
  std::vector<std::string> receive(std::size_t bus) {
    std::vector<std::string> texts;
    for (fieldbus::TimedFrame timed; network->bus(bus).receive(timed);) texts.push_back(testing::to_text(timed.frame));
    return texts;
  }
  void pass(std::int64_t ns) { network->sleep_until(network->now_ns() + ns); }
  std::vector<std::string> ask(std::size_t bus, const std::string& text) {
    send(bus, text);
    pass(ms);
    return receive(bus);
  }
  // RPDO1 {6040, 607A}, TPDO1 {6041, 6064}, every SYNC; mode 8; 1 ms.
  void configure(std::size_t bus, int node) {
    char prefix[8];
    std::snprintf(prefix, sizeof prefix, "%03X#", 0x600u + static_cast<unsigned>(node));
    const auto id = [node](int base) {
      char text[8];
      std::snprintf(text, sizeof text, "%02X%02X", (base + node) & 0xFF, (base + node) >> 8);
      return std::string(text);
    };
    for (const std::string& request :
         {"23001401" + id(0x200) + "0080", std::string("2F00160000000000"), std::string("2300160110004060"),
          std::string("2300160220007A60"), std::string("2F00160002000000"), std::string("2F00140201000000"),
          "23001401" + id(0x200) + "0000", "23001801" + id(0x180) + "0080", std::string("2F001A0000000000"),
          std::string("23001A0110004160"), std::string("23001A0220006460"), std::string("2F001A0002000000"),
          std::string("2F00180201000000"), "23001801" + id(0x180) + "0000", std::string("2F60600008000000"),
          std::string("2FC2600101000000"), std::string("2FC26002FD000000")}) {
      const auto answers = ask(bus, prefix + request);
      ASSERT_EQ(answers.size(), 1u) << request;
      ASSERT_EQ(answers[0].substr(4, 2), "60") << request << " answered " << answers[0];
    }
  }

  description::Cell cell;
  description::SensorDescription sensor;
  std::unique_ptr<fieldbus::SimulatedCanNetwork> network;
  std::unique_ptr<SimulatedCell> far_end;
};

TEST_F(SimulatedCellTest, BootsUpOnTheBusesOfTheCell) {
  start();
  pass(50 * ms);
  EXPECT_THAT(receive(0), ElementsAre("701#00", "702#00", "703#00"));
  EXPECT_THAT(receive(1), ElementsAre("704#00", "705#00", "706#00"));
  EXPECT_THAT(receive(2), IsEmpty());
  EXPECT_THAT(ask(0, "602#4000100000000000"), ElementsAre("582#4300100092010200"));
  EXPECT_THAT(ask(2, "688#"), ElementsAre("688#0203"));
  EXPECT_EQ(ask(2, "680#").size(), 2u);
}

// Where the arm stands at rest: 6064h is the start pose in counts, motor side, gears wound up by gravity.
TEST_F(SimulatedCellTest, StandsAtTheStartPose) {
  start();
  pass(50 * ms);
  for (std::size_t axis = 0; axis < 6; ++axis) {
    const auto& drive = cell.drives[axis];
    const auto counts = static_cast<double>(far_end->drive(axis).canopen().dictionary().number(0x6064));
    const double rad = (counts - drive.offset_counts) / drive.counts_per_rad();
    // Gravity's torque is at most 1500 Nm over the softest gear of 16,000 Nm/rad, far less in fact.
    EXPECT_NEAR(rad, cell.start_rad[axis], 0.01) << axis;
  }
  const Truth truth = far_end->truth();
  EXPECT_NEAR(truth.X_WT.translation().x(), 0.7, 1e-3);
  EXPECT_NEAR(truth.X_WT.translation().z(), 0.6, 1e-3);
  EXPECT_LT(truth.velocity_W.norm(), 1e-9);
}

// Axis 1 by literal bytes: 06, 07, 0F at its own position, then 200 targets of 1000 counts each.
TEST_F(SimulatedCellTest, MovesADriveThatAHandTypedMasterEnables) {
  start();
  pass(50 * ms);
  receive(0);
  configure(0, 1);
  send(0, "000#0101");
  std::int32_t target = static_cast<std::int32_t>(far_end->drive(0).canopen().dictionary().number(0x6064));
  const double start_rad = far_end->plant().arm().joint_angle_rad(0);
  std::string last;
  const auto cycle = [&](int controlword) {
    send(0, "080#");
    pass(ms / 2);
    for (const auto& text : receive(0)) {
      if (text.substr(0, 4) == "181#") last = text;
    }
    char rpdo[32];
    const auto t = static_cast<std::uint32_t>(target);
    std::snprintf(rpdo, sizeof rpdo, "201#%02X00%02X%02X%02X%02X", static_cast<unsigned>(controlword), t & 0xFF,
                  t >> 8 & 0xFF, t >> 16 & 0xFF, t >> 24 & 0xFF);
    send(0, rpdo);
    pass(ms / 2);
  };
  for (int i = 0; i < 5; ++i) cycle(0x06);
  EXPECT_EQ(last.substr(4, 4), "3102");
  for (int i = 0; i < 3; ++i) cycle(0x07);
  EXPECT_EQ(last.substr(4, 4), "3302");
  for (int i = 0; i < 50; ++i) cycle(0x0F);
  EXPECT_EQ(last.substr(4, 4), "3712");
  for (int i = 0; i < 200; ++i) {
    target += 1000;
    cycle(0x0F);
  }
  for (int i = 0; i < 300; ++i) cycle(0x0F);
  EXPECT_EQ(last.substr(4, 4), "3712");
  const double moved_rad = far_end->plant().arm().joint_angle_rad(0) - start_rad;
  // The gear's swing of 10-odd Hz at a few per cent of damping has died away to well under a per cent by then.
  EXPECT_NEAR(moved_rad, 200'000.0 / cell.drives[0].counts_per_rad(), 1e-4);
  // Off again: brake closed, no power.
  for (int i = 0; i < 3; ++i) cycle(0x00);
  EXPECT_EQ(last.substr(4, 4), "5002");
  EXPECT_TRUE(far_end->plant().arm().braked(0));
}

TEST_F(SimulatedCellTest, ObserverSeesEachStepOnce) {
  start();
  std::vector<std::int64_t> times;
  far_end->set_observer([&](const Truth& truth) { times.push_back(truth.time_ns); });
  pass(10 * ms);
  ASSERT_EQ(times.size(), 40u);
  for (std::size_t i = 0; i < times.size(); ++i) EXPECT_EQ(times[i], static_cast<std::int64_t>(i + 1) * ms / 4);
}

TEST_F(SimulatedCellTest, FaultsAtStart) {
  start({"axis_3:silent", "axis_2:device_type=0x00030191", "sensor:silent"});
  pass(50 * ms);
  EXPECT_THAT(receive(0), ElementsAre("701#00", "702#00"));
  EXPECT_THAT(ask(0, "602#4000100000000000"), ElementsAre("582#4300100091010300"));
  EXPECT_THAT(ask(0, "603#4000100000000000"), IsEmpty());
  EXPECT_THAT(ask(2, "687#"), IsEmpty());
}

TEST_F(SimulatedCellTest, FaultsComeAndGoAtTheirTimes) {
  start({"axis_1:fault=0x4210@100ms", "axis_2:power@100ms..200ms", "sensor:half@100ms..200ms",
         "axis_4:silent@100ms..200ms"});
  pass(90 * ms);
  EXPECT_EQ(ask(2, "680#").size(), 2u);
  receive(0);
  pass(20 * ms);
  EXPECT_THAT(receive(0), ElementsAre("081#1042210000000000"));
  EXPECT_EQ(ask(2, "680#").size(), 1u);
  EXPECT_THAT(ask(0, "602#4000100000000000"), IsEmpty());
  receive(1);
  EXPECT_THAT(ask(1, "604#4000100000000000"), IsEmpty());
  pass(150 * ms);
  EXPECT_THAT(receive(0), ElementsAre("702#00"));
  EXPECT_EQ(ask(2, "680#").size(), 2u);
  EXPECT_THAT(ask(1, "604#4000100000000000"), ElementsAre("584#4300100092010200"));
}

TEST_F(SimulatedCellTest, RefusesAFaultForADeviceThatIsNotThere) {
  EXPECT_THROW(start({"axis_9:silent"}), description::SetupError);
}

TEST_F(SimulatedCellTest, TwoRunsAreIdentical) {
  const auto run = [this] {
    start();
    std::string all;
    network->set_observer([&all](const fieldbus::WireFrame& wire) {
      all += std::to_string(wire.end_ns) + " " + testing::to_text(wire.frame) + "\n";
    });
    pass(50 * ms);
    for (int i = 0; i < 100; ++i) {
      send(2, "680#");
      send(0, "080#");
      pass(ms);
    }
    return all;
  };
  const std::string first = run();
  EXPECT_EQ(first, run());
  EXPECT_THAT(first, HasSubstr("681#"));
}

// How long the far end takes for a second of six axes in full exchange; a figure to look at, with a generous bound.
TEST_F(SimulatedCellTest, TimingOfTheFarEnd) {
  start();
  pass(50 * ms);
  for (int node = 1; node <= 6; ++node) {
    receive(0);
    receive(1);
    configure(node <= 3 ? 0 : 1, node);
  }
  send(0, "000#0100");
  send(1, "000#0100");
  const std::clock_t began = std::clock();  // of this process, whatever else the machine does
  for (int i = 0; i < 1000; ++i) {
    for (std::size_t bus = 0; bus < 2; ++bus) send(bus, "080#");
    send(2, "680#");
    pass(ms / 2);
    for (const char* rpdo : {"201#060000000000", "202#060000000000", "203#060000000000"}) send(0, rpdo);
    for (const char* rpdo : {"204#060000000000", "205#060000000000", "206#060000000000"}) send(1, rpdo);
    pass(ms / 2);
    for (std::size_t bus = 0; bus < 3; ++bus) {
      fieldbus::TimedFrame timed;
      while (network->bus(bus).receive(timed)) {
      }
    }
  }
  const double took_s = static_cast<double>(std::clock() - began) / CLOCKS_PER_SEC;
  std::printf("far end: %.1f ms of processor time for 1 s of six axes\n", 1e3 * took_s);
  EXPECT_LT(took_s, 5.0);
}

TEST(DeviceFault, IsReadFromText) {
  const DeviceFault fault = parse_device_fault("axis_2:fault=0x4210@1.5s..2s");
  EXPECT_EQ(fault.device, "axis_2");
  EXPECT_EQ(fault.kind, DeviceFaultKind::drive_fault);
  EXPECT_EQ(fault.value, 0x4210u);
  EXPECT_EQ(fault.from_ns, 1'500'000'000);
  EXPECT_EQ(fault.until_ns, 2'000'000'000);
  EXPECT_EQ(parse_device_fault("sensor:silent").kind, DeviceFaultKind::sensor_silent);
  const DeviceFault runaway = parse_device_fault("axis_3:runaway=-0.5rad/s@1s");
  EXPECT_EQ(runaway.kind, DeviceFaultKind::runaway);
  EXPECT_EQ(runaway.amount, -0.5);
  EXPECT_EQ(parse_device_fault("axis_3:runaway=0.5").amount, 0.5);
  EXPECT_EQ(parse_device_fault("axis_3:offset=-5mrad").amount, -5e-3);
  EXPECT_EQ(parse_device_fault("axis_2:weak=100Nm").amount, 100.0);
  EXPECT_EQ(parse_device_fault("axis_2:weak=0").amount, 0.0);
  EXPECT_EQ(parse_device_fault("axis_2:ignored@1s").kind, DeviceFaultKind::ignored);
}

TEST(DeviceFault, RefusesWhatItCannotBe) {
  for (const char* text : {"",
                           "axis_2",
                           ":silent",
                           "axis_2:",
                           "axis_2:nonsense",
                           "axis_2:frozen",
                           "sensor:fault=1",
                           "axis_2:fault",
                           "axis_2:silent=3",
                           "axis_2:fault=",
                           "axis_2:fault=0x",
                           "axis_2:fault=99999999999",
                           "axis_2:fault=1@",
                           "axis_2:fault=1@3",
                           "axis_2:silent@2s..1s",
                           "axis_2:silent@2s..2s",
                           "axis_2:device_type=1@2s",
                           "axis_2:runaway",
                           "axis_2:runaway=",
                           "axis_2:runaway=0",
                           "axis_2:runaway=--1",
                           "axis_2:runaway=5mrad",
                           "axis_2:offset=5mm",
                           "axis_2:weak=-1",
                           "axis_2:stuck=1",
                           "sensor:offset=1mrad"}) {
    EXPECT_THROW((void)parse_device_fault(text), description::SetupError) << text;
  }
}

}  // namespace
}  // namespace proxarm::sim
