// `proxarm scan` against the simulated cell, and what it refuses.
#include "fieldbus/cia402/bus_scan.hpp"

#include <filesystem>
#include <memory>

#include "fieldbus/simulated/simulated_can_network.hpp"
#include "models/base/setup_error.hpp"
#include "sim/cell/simulated_cell.hpp"
#include "tests/sim/devices/device_harness.hpp"
#include "tests/source_file.hpp"

namespace proxarm::sim {
namespace {

using ::testing::HasSubstr;
using testing::ms;

const std::filesystem::path source = source_file();

// Writes down what the scan sends.
struct Listener final : fieldbus::CanListener {
  std::vector<fieldbus::CanFrame> heard;
  void on_frame(const fieldbus::CanFrame& frame, std::int64_t) noexcept override { heard.push_back(frame); }
};

struct BusScan : ::testing::Test {
  BusScan() {
    network = std::make_unique<fieldbus::SimulatedCanNetwork>(simulated_buses(cell));
    const auto sensor = description::load_sensor(source / "models/sensors/ati_net_can_oem.yaml");
    far_end = std::make_unique<SimulatedCell>(cell, sensor, description::HandDescription{}, network->events());
    far_end->attach_to(*network);
    far_end->power_on();
  }
  description::Cell cell = description::load_cell(source / "models/cells/default.yaml");
  std::unique_ptr<fieldbus::SimulatedCanNetwork> network;
  std::unique_ptr<SimulatedCell> far_end;
};

TEST_F(BusScan, FindsTheDrivesAndSaysWhatTheyAre) {
  Listener listener;
  network->simulated_bus("axes_1_3").attach(listener, "listener");
  const fieldbus::ScanResult result = fieldbus::scan_bus(*network, 0);
  ASSERT_EQ(result.nodes.size(), 3U);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(result.nodes[i].node, i + 1);
    EXPECT_EQ(result.nodes[i].device_type, 0x00020192U);
    EXPECT_EQ(result.nodes[i].serial, i + 1);
    ASSERT_TRUE(result.nodes[i].statusword.has_value());
  }
  const std::string text = fieldbus::scan_text(result, {});
  EXPECT_THAT(text, HasSubstr("node 2: device type 0x00020192 (CiA 402 drive)"));
  EXPECT_THAT(text, HasSubstr("switch on disabled"));
  EXPECT_THAT(text, HasSubstr("heartbeat of node 3"));
  // All that it sent are SDO uploads.
  std::size_t requests = 0;
  for (const fieldbus::CanFrame& frame : listener.heard) {
    if ((frame.id & 0x780) != 0x600) continue;
    ++requests;
    EXPECT_EQ(frame.data[0], 0x40);
  }
  EXPECT_EQ(requests, 127U + 3 * 7);
}

TEST_F(BusScan, PollsASensorOnlyWhereTheUserNamesIt) {
  EXPECT_FALSE(fieldbus::scan_bus(*network, 2).sensor_gauges.has_value());
  const fieldbus::ScanSettings settings{.sensor_base_id = 0x68};
  const fieldbus::ScanResult result = fieldbus::scan_bus(*network, 2, settings);
  ASSERT_TRUE(result.sensor_gauges.has_value());
  EXPECT_EQ(result.sensor_status, 0U);
  EXPECT_THAT(fieldbus::scan_text(result, settings),
              HasSubstr("sensor at base id 0x68: ATI Net CAN OEM, status 0x0000"));
  EXPECT_THROW((void)fieldbus::scan_bus(*network, 2, {.sensor_base_id = 0x08}), description::SetupError);
}

TEST_F(BusScan, RefusesABusThatSomebodyRuns) {
  struct Nobody final : fieldbus::CanListener {
    void on_frame(const fieldbus::CanFrame&, std::int64_t) noexcept override {}
  } nobody;
  fieldbus::CanPort& master = network->simulated_bus("axes_1_3").attach(nobody, "other master");
  network->events().schedule(700 * ms, [&](std::int64_t) { master.send(testing::from_text("080#")); });
  try {
    (void)fieldbus::scan_bus(*network, 0);
    FAIL() << "scanned";
  } catch (const description::SetupError& error) {
    EXPECT_THAT(error.what(), HasSubstr("found SYNC (0x080), 1 time"));
  }
  EXPECT_EQ(network->bus(0).status().frames_sent, 0U);
}

TEST(BusScanText, NamesConnectionsAndModes) {
  EXPECT_EQ(fieldbus::connection_text(0x181), "TPDO1 of node 1");
  EXPECT_EQ(fieldbus::connection_text(0x57F), "RPDO4 of node 127");
  EXPECT_EQ(fieldbus::connection_text(0x583), "SDO answer of node 3");
  EXPECT_EQ(fieldbus::connection_text(0x703), "heartbeat of node 3");
  EXPECT_EQ(fieldbus::connection_text(0x001), "no CANopen connection: a sensor?");
  EXPECT_EQ(fieldbus::supported_modes_text(0x000002C0), "IP CSP CST");  // bits 6, 7 and 9: modes 7, 8 and 10
  EXPECT_EQ(fieldbus::supported_modes_text(0), "none");
}

}  // namespace
}  // namespace proxarm::sim
