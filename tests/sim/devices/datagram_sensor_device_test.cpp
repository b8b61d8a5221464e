// The simulated force sensor on UDP: what it sends byte by byte, in this process and on a loopback port.
#include "sim/devices/datagram_sensor_device.hpp"

#include <gmock/gmock.h>

#include <chrono>
#include <thread>

#include "fieldbus/udp/udp_port.hpp"
#include "models/base/setup_error.hpp"
#include "sim/devices/udp_server.hpp"
#include "tests/source_file.hpp"

namespace proxarm::sim {
namespace {

using Bytes = std::vector<std::uint8_t>;

const Bytes stop{0x12, 0x34, 0, 0, 0, 0, 0, 0}, start{0x12, 0x34, 0, 2, 0, 0, 0, 0};

struct Load final : WrenchSource {
  std::array<double, 6> load{1.0, -1.0, 0.000001, 0.5, -0.25, 0.0};
  std::array<double, 6> wrench(std::int64_t) noexcept override { return load; }
};

struct SimulatedNetFt : ::testing::Test {
  static constexpr std::int64_t ready_ns = 20'000'000;

  Load load;
  DatagramSensorDevice wire;
  DescribedDevice device{description::load_sensor(source_file("models/sensors/ati_net_ft.yaml")), {}, load, wire};

  void SetUp() override { device.power_on(0); }
  void convert(std::int64_t time_ns) {
    wire.obey(device, time_ns);
    device.on_converter(time_ns);
  }
  static Bytes bytes_of(const fieldbus::Datagram& datagram) { return {datagram.view().begin(), datagram.view().end()}; }
};

TEST_F(SimulatedNetFt, SendsTwoSequencesTheStatusAndSixCounts) {
  InProcessPort port(wire);
  ASSERT_TRUE(port.send(start));
  convert(ready_ns);
  convert(ready_ns + 1'000'000);
  fieldbus::Datagram read;
  ASSERT_FALSE(port.receive(read, ready_ns)) << "it is on its way";
  ASSERT_TRUE(port.receive(read, ready_ns + InProcessPort::on_the_way_ns));
  //        1           1           0           1,000,000            −1,000,000
  EXPECT_EQ(bytes_of(read), (Bytes{0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 0, 0x00, 0x0F, 0x42, 0x40, 0xFF, 0xF0, 0xBD, 0xC0,
                                   //        1           500,000                 −250,000                0
                                   0, 0, 0, 1, 0x00, 0x07, 0xA1, 0x20, 0xFF, 0xFC, 0x2F, 0x70, 0, 0, 0, 0}));
  ASSERT_TRUE(port.receive(read, ready_ns + 2'000'000));
  EXPECT_EQ(read.data[3], 2) << "the next number";
  EXPECT_FALSE(port.receive(read, ready_ns + 2'000'000));
}

TEST_F(SimulatedNetFt, IsSilentUntilItIsStartedAndAfterItIsStopped) {
  InProcessPort port(wire);
  fieldbus::Datagram read;
  for (const Bytes& request : {Bytes{}, Bytes{0x12}, Bytes{0x12, 0x35, 0, 2, 0, 0, 0, 0}, stop}) {
    ASSERT_TRUE(port.send(request));
    convert(ready_ns);
    EXPECT_FALSE(port.receive(read, 2 * ready_ns));
  }
  ASSERT_TRUE(port.send(start));
  convert(ready_ns);
  EXPECT_TRUE(port.receive(read, 2 * ready_ns));
  ASSERT_TRUE(port.send(stop));
  convert(ready_ns + 1'000'000);
  EXPECT_FALSE(port.receive(read, 2 * ready_ns));
}

TEST_F(SimulatedNetFt, DropsWhatNobodyTakes) {
  InProcessPort port(wire);
  ASSERT_TRUE(port.send(start));
  for (int i = 0; i < 1000; ++i) convert(ready_ns + 1000 * i);
  fieldbus::Datagram read;
  int count = 0;
  while (port.receive(read, 2 * ready_ns)) ++count;
  EXPECT_EQ(count, 128);
}

TEST_F(SimulatedNetFt, ReadsNoFloodToItsEnd) {
  struct Flood final : DatagramWire {
    int taken = 0;
    void send(std::span<const std::uint8_t>, std::int64_t) noexcept override {}
    bool take(fieldbus::Datagram& request) noexcept override {
      request.bytes = 0;
      return ++taken > 0;
    }
  } flood;
  wire.connect(flood);
  wire.obey(device, ready_ns);
  EXPECT_EQ(flood.taken, DatagramSensorDevice::most_requests);
}

TEST_F(SimulatedNetFt, NeedsNoPortAtAll) {
  convert(ready_ns);
  { const InProcessPort port(wire); }
  convert(ready_ns + 1'000'000);
}

TEST_F(SimulatedNetFt, AnswersTheLatestRequestOnALoopbackPort) {
  UdpServer server("127.0.0.1", 0);
  wire.connect(server);
  const auto first = fieldbus::open_udp({"127.0.0.1", server.port()});
  const auto second = fieldbus::open_udp({"127.0.0.1", server.port()});
  const auto hears = [&](fieldbus::DatagramPort& port) {
    fieldbus::Datagram read;
    for (int i = 0; i < 100; ++i) {
      convert(ready_ns + 1'000'000 * i);
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
      if (port.receive(read, 0)) return true;
    }
    return false;
  };
  ASSERT_TRUE(first->send(start));
  EXPECT_TRUE(hears(*first));
  ASSERT_TRUE(second->send(start));
  EXPECT_TRUE(hears(*second));
  fieldbus::Datagram read;
  while (first->receive(read, 0)) continue;
  EXPECT_FALSE(hears(*first));
}

TEST(UdpServerPort, IsOfTheLoopbackInterfaceAlone) {
  for (const char* host : {"0.0.0.0", "192.0.2.1", "255.255.255.255", "localhost"}) {
    EXPECT_THROW(UdpServer(host, 0), description::SetupError) << host;
  }
  const UdpServer server("127.0.0.1", 0);
  EXPECT_THROW(UdpServer("127.0.0.1", server.port()), description::SetupError) << "it is taken";
}

}  // namespace
}  // namespace proxarm::sim
