// The simulated sensors of other makes: their bytes against the makers' figures, and the master's decoder against the
// truth of the far end, with all that goes wrong.
#include "sim/devices/described_device.hpp"

#include <cmath>
#include <filesystem>
#include <memory>

#include "fieldbus/sensors/described_sensor.hpp"
#include "fieldbus/simulated/simulated_can_network.hpp"
#include "models/base/setup_error.hpp"
#include "sim/cell/simulated_cell.hpp"
#include "tests/sim/devices/device_harness.hpp"
#include "tests/source_file.hpp"

namespace proxarm::sim {
namespace {

using ::testing::ElementsAre;
using testing::ms;

const std::filesystem::path source = source_file();

// The Robotous with its identifiers set to three above the drives'.
description::SensorDescription shipped(const std::string& name) {
  description::SensorChoices choices;
  if (name == "robotous_rft") choices.settings = {{"command_id", 0x1F0}, {"first_id", 0x1F1}, {"second_id", 0x1F2}};
  return description::load_sensor(source / "models/sensors" / (name + ".yaml"), choices);
}

struct FixedWrench final : WrenchSource {
  std::array<double, 6> value{};
  [[nodiscard]] std::array<double, 6> wrench(std::int64_t) noexcept override { return value; }
};

struct NotedPort final : DevicePort {
  std::vector<std::string> sent;
  void send(const fieldbus::CanFrame& frame, std::int64_t) noexcept override {
    sent.push_back(testing::to_text(frame));
  }
};

std::vector<std::string> sample_of(const std::string& name, std::uint32_t base_id, const std::string& start,
                                   const std::array<double, 6>& wrench) {
  FixedWrench source_of_wrench;
  source_of_wrench.value = wrench;
  NotedPort port;
  const auto description = shipped(name);
  DescribedDevice device(description, {.base_id = base_id}, source_of_wrench, port);
  device.power_on(0);
  fieldbus::CanFrame command = testing::from_text(start);
  command.extended = description.described->extended;
  device.on_frame(command, 20 * ms);
  device.on_converter(21 * ms);
  return port.sent;
}

// The same bytes as in tests/fieldbus/sensors/described_sensor_test.cpp, worked out by hand there.
TEST(DescribedDevice, SendsWhatTheMakersSend) {
  EXPECT_THAT(sample_of("aidin_aft200", 0, "102#0103010000000000", {1, -20, 0.01, 1, -0.002, 2}),
              ElementsAre("001#75946D6075310000", "002#639C61A765900000"));
  EXPECT_THAT(sample_of("robotous_rft", 0, "1F0#0B00000000000000", {1, -1, 10, 1, -1, 0.0005}),
              ElementsAre("1F1#0B0032FFCE01F407", "1F2#D0F8300001000000"));
  EXPECT_THAT(sample_of("onrobot_hex", 0, "101#AA00320301010000", {1, -1, 10, 1, -1, 0.001}),
              ElementsAre("100#AA07081000000000", "100#000AFFF6006403E8", "100#FC180001052C"));
}

TEST(DescribedDevice, StreamsOnlyWhenToldTo) {
  EXPECT_TRUE(sample_of("aidin_aft200", 0, "102#0102010000000000", {}).empty());
  EXPECT_TRUE(sample_of("robotous_rft", 0, "1F0#0C00000000000000", {}).empty());
  EXPECT_TRUE(sample_of("onrobot_hex", 0, "101#AA00320300010000", {}).empty());
}

// One of the shipped sensors in the default cell, read by the master once a millisecond.
struct SensorInCell {
  explicit SensorInCell(const std::string& name, const std::vector<std::string>& faults = {}) {
    cell.sensor.base_id = name == "wacoh_dynpick" ? 7 : 0;
    cell.sensor.noise_N = cell.sensor.noise_Nm = 0.0;
    network = std::make_unique<fieldbus::SimulatedCanNetwork>(simulated_buses(cell));
    SimulatedCellConfig config;
    for (const auto& text : faults) config.faults.push_back(parse_device_fault(text));
    far_end =
        std::make_unique<SimulatedCell>(cell, shipped(name), description::HandDescription{}, network->events(), config);
    far_end->attach_to(*network);
    far_end->power_on();
    sensor = std::make_unique<fieldbus::DescribedSensor>(
        shipped(name), fieldbus::DescribedSensorSettings{.bus_name = "sensor", .base_id = cell.sensor.base_id});
    sensor->start(*network, 2);
  }
  // Whether a sample was there in that cycle.
  bool cycle() {
    fieldbus::CanFrame request;
    if (sensor->poll(network->now_ns(), request)) network->bus(2).send(request);
    network->sleep_until(network->now_ns() + ms);
    for (fieldbus::TimedFrame timed; network->bus(2).receive(timed);) sensor->on_frame(timed.frame, timed.time_ns);
    return sensor->fresh();
  }
  // A stream isn't in step with the cycle: where its frames end near a cycle's, one cycle may see none and the next
  // two.
  int samples_in(int cycles) {
    const std::uint64_t before = sensor->latest().number;
    for (int i = 0; i < cycles; ++i) cycle();
    return static_cast<int>(sensor->latest().number - before);
  }

  description::Cell cell = description::load_cell(source / "models/cells/default.yaml");
  std::unique_ptr<fieldbus::SimulatedCanNetwork> network;
  std::unique_ptr<SimulatedCell> far_end;
  std::unique_ptr<fieldbus::DescribedSensor> sensor;
};

struct Make {
  const char* name;
  double step_N, step_Nm;  // one count
};
constexpr Make makes[] = {{"aidin_aft200", 0.01, 0.002},
                          {"robotous_rft", 0.02, 0.0005},
                          {"onrobot_hex", 0.1, 0.001},
                          {"wacoh_dynpick", 1 / 32.765, 1 / 436.867}};

TEST(DescribedDevice, IsReadAsTheTruthIsToHalfACount) {
  for (const Make& make : makes) {
    SensorInCell rig(make.name);
    EXPECT_GE(rig.samples_in(200), 198) << make.name;
    const models::Wrench& truth = rig.far_end->truth().sensor_wrench_S;
    for (int i = 0; i < 3; ++i) {
      const auto at = static_cast<std::size_t>(i);
      // The arm is at rest behind its brakes; a millinewton covers what it still swings.
      EXPECT_NEAR(rig.sensor->latest().wrench_S[at], truth.force[i], 0.5 * make.step_N + 1e-3) << make.name << i;
      EXPECT_NEAR(rig.sensor->latest().wrench_S[at + 3], truth.torque[i], 0.5 * make.step_Nm + 1e-3) << make.name << i;
    }
  }
}

// From 200 ms on; the master has started at some 15 ms.
TEST(DescribedDevice, FaultsAreNoticedAndNeverReadAsForce) {
  for (const Make& make : makes) {
    for (const char* fault : {"sensor:silent@0.2s", "sensor:samples@0.2s", "sensor:half@0.2s", "sensor:swapped@0.2s",
                              "sensor:short@0.2s"}) {
      SensorInCell rig(make.name, {fault});
      rig.samples_in(190);
      const fieldbus::Wrench before = rig.sensor->latest().wrench_S;
      EXPECT_LE(rig.samples_in(100), 25) << make.name << fault;  // the last good ones
      EXPECT_EQ(rig.samples_in(50), 0) << make.name << fault;
      for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(rig.sensor->latest().wrench_S[i], before[i], 0.5) << fault;
    }
    SensorInCell twice(make.name, {"sensor:duplicated"});
    EXPECT_GE(twice.samples_in(100), 98) << make.name;
    SensorInCell late(make.name, {"sensor:delay=300"});
    EXPECT_GE(late.samples_in(100), 98) << make.name;
    SensorInCell lossy(make.name, {"sensor:lost=10"});
    const int left = lossy.samples_in(100);
    EXPECT_GE(left, 55) << make.name;
    EXPECT_LE(left, 95) << make.name;
    SensorInCell frozen(make.name, {"sensor:frozen@0.1s"});
    frozen.samples_in(300);
    EXPECT_GE(frozen.sensor->counts().repeated + frozen.sensor->latest().repeats, 100U) << make.name;
    SensorInCell full(make.name, {"sensor:saturated@0.1s"});
    full.samples_in(200);
    EXPECT_TRUE(full.sensor->latest().saturated) << make.name;
  }
  SensorInCell spoilt("onrobot_hex", {"sensor:checksum@0.1s"});
  spoilt.samples_in(200);
  EXPECT_GE(spoilt.sensor->counts().bad_checksums, 90U);
  EXPECT_EQ(spoilt.samples_in(10), 0);
}

}  // namespace
}  // namespace proxarm::sim
