// The event loop behind `proxarm sim`, on the in-process network in place of a kernel's, and on a real vcan.
#include "sim/cell/far_end_process.hpp"

#include <filesystem>
#include <thread>

#include "fieldbus/can/socket_can_network.hpp"
#include "fieldbus/simulated/simulated_can_network.hpp"
#include "models/base/setup_error.hpp"
#include "tests/sim/devices/device_harness.hpp"
#include "tests/source_file.hpp"

namespace proxarm::sim {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using testing::ms;

const std::filesystem::path source = source_file();

// A master that sends what it was told at given times and writes down what it hears.
struct ScriptedMaster final : fieldbus::CanListener {
  void on_frame(const fieldbus::CanFrame& frame, std::int64_t) noexcept override {
    heard.push_back(testing::to_text(frame));
  }
  std::vector<std::string> heard;
};

struct FarEndProcessTest : ::testing::Test {
  FarEndProcessTest() : cell(description::load_cell(source / "models/cells/default.yaml")) {
    sensor = description::load_sensor(source / "models/sensors/ati_net_can_oem.yaml");
  }
  description::Cell cell;
  description::SensorDescription sensor;
  description::HandDescription hand;
  std::atomic<bool> stop{false};
};

TEST_F(FarEndProcessTest, CarriesAllBusesOnOneInterface) {
  fieldbus::SimulatedCanNetwork network({{.name = "vcan0"}});
  ScriptedMaster master;
  fieldbus::CanPort& port = network.simulated_bus(0).attach(master, "master");
  FarEndProcess process(cell, sensor, hand, network, {0, 0, 0});
  process.run(stop, 50 * ms);
  EXPECT_THAT(master.heard, ElementsAre("701#00", "702#00", "703#00", "704#00", "705#00", "706#00"));
  master.heard.clear();
  network.events().schedule(60 * ms, [&] {
    port.send(testing::from_text("605#4000100000000000"));
    port.send(testing::from_text("680#"));
  });
  process.run(stop, 100 * ms);
  EXPECT_THAT(master.heard, Contains("585#4300100092010200"));
  EXPECT_EQ(master.heard.size(), 3u);
  EXPECT_EQ(process.statistics().frames_received, 2u);
  EXPECT_EQ(process.statistics().frames_sent, 9u);
  EXPECT_EQ(process.statistics().late_wake_ups, 0u);
}

TEST_F(FarEndProcessTest, KeepsBusesApartThatHaveInterfacesOfTheirOwn) {
  fieldbus::SimulatedCanNetwork network({{.name = "can0"}, {.name = "can1"}, {.name = "can2"}});
  ScriptedMaster masters[3];
  for (std::size_t i = 0; i < 3; ++i) network.simulated_bus(i).attach(masters[i], "master");
  FarEndProcess process(cell, sensor, hand, network, {2, 1, 0});
  process.run(stop, 50 * ms);
  EXPECT_THAT(masters[0].heard, IsEmpty());
  EXPECT_THAT(masters[1].heard, ElementsAre("704#00", "705#00", "706#00"));
  EXPECT_THAT(masters[2].heard, ElementsAre("701#00", "702#00", "703#00"));
}

TEST_F(FarEndProcessTest, EndsWhenToldToStop) {
  fieldbus::SimulatedCanNetwork network({{.name = "vcan0"}});
  FarEndProcess process(cell, sensor, hand, network, {0, 0, 0});
  network.events().schedule(30 * ms, [this] { stop = true; });
  process.run(stop);
  EXPECT_GE(network.now_ns(), 30 * ms);
  EXPECT_LE(network.now_ns(), 51 * ms);
}

TEST_F(FarEndProcessTest, RefusesTwoDrivesWithOneNodeOnOneInterface) {
  cell.drives[3].node = 1;  // axis 4 has a bus of its own, so the cell is sound
  fieldbus::SimulatedCanNetwork network({{.name = "vcan0"}, {.name = "vcan1"}});
  EXPECT_NO_THROW(FarEndProcess(cell, sensor, hand, network, {0, 1, 0}));
  EXPECT_THROW(FarEndProcess(cell, sensor, hand, network, {0, 0, 0}), description::SetupError);
  EXPECT_THROW(FarEndProcess(cell, sensor, hand, network, {0, 0}), description::SetupError);
}

TEST_F(FarEndProcessTest, RefusesASensorThatSpeaksWithADrivesIdentifiers) {
  fieldbus::SimulatedCanNetwork network({{.name = "vcan0"}, {.name = "vcan1"}});
  for (const std::uint32_t base : {0x00u, 0x08u, 0x18u, 0x20u, 0x58u, 0x60u, 0x70u}) {
    cell.sensor.base_id = base;
    EXPECT_THROW(FarEndProcess(cell, sensor, hand, network, {0, 0, 0}), description::SetupError) << base;
    EXPECT_NO_THROW(FarEndProcess(cell, sensor, hand, network, {0, 0, 1})) << base;
  }
  for (const std::uint32_t base : {0x01u, 0x10u, 0x68u, 0x78u}) {
    cell.sensor.base_id = base;
    EXPECT_NO_THROW(FarEndProcess(cell, sensor, hand, network, {0, 0, 0})) << base;
  }
}

// The same on a real kernel's vcan0 and vcan1: the far end in a thread of its own, a master typed by hand in this one.
// Bytes alone: how fast things are depends on the machine and its clock.
TEST(FarEndVcan, AnswersOverARealKernelsInterfaces) {
  const description::Cell cell = description::load_cell(source / "models/cells/default.yaml");
  const auto sensor = description::load_sensor(source / "models/sensors/ati_net_can_oem.yaml");
  fieldbus::SocketCanNetwork network({"vcan0", "vcan1"});
  std::atomic<bool> stop{false};
  FarEndStatistics statistics;
  std::thread far_end([&] {
    statistics = run_on_socketcan(cell, sensor, description::HandDescription{}, {"vcan0", "vcan0", "vcan1"}, stop);
  });
  const auto hear = [&](std::size_t bus, std::size_t count, std::int64_t patience_ns) {
    std::vector<std::string> heard;
    const std::int64_t deadline_ns = network.now_ns() + patience_ns;
    while (heard.size() < count && network.now_ns() < deadline_ns) {
      network.wait_for_frame(deadline_ns);
      for (fieldbus::TimedFrame timed; network.bus(bus).receive(timed);) {
        heard.push_back(testing::to_text(timed.frame));
      }
    }
    return heard;
  };
  EXPECT_THAT(hear(0, 6, 5'000 * ms), ElementsAre("701#00", "702#00", "703#00", "704#00", "705#00", "706#00"));
  network.bus(0).send(testing::from_text("604#4000100000000000"));
  EXPECT_THAT(hear(0, 1, 2'000 * ms), ElementsAre("584#4300100092010200"));
  network.bus(1).send(testing::from_text("688#"));
  EXPECT_THAT(hear(1, 1, 2'000 * ms), ElementsAre("688#0203"));
  network.bus(0).send(testing::from_text("602#2F00180201000000"));  // transmit PDO 1 of node 2 with every SYNC
  EXPECT_THAT(hear(0, 1, 2'000 * ms), ElementsAre("582#6000180200000000"));
  network.bus(0).send(testing::from_text("000#0102"));
  for (int i = 0; i < 100; ++i) {
    network.bus(0).send(testing::from_text("080#"));
    EXPECT_THAT(hear(0, 1, 2'000 * ms), ElementsAre("182#5002")) << i;  // switch on disabled, voltage, remote
  }
  stop = true;
  far_end.join();
  EXPECT_EQ(statistics.frames_lost, 0u);
  EXPECT_EQ(statistics.frames_not_sent, 0u);
  EXPECT_EQ(statistics.frames_received, 104u);
}

}  // namespace
}  // namespace proxarm::sim
