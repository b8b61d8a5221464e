// The ATI Net F/T by its file: datagrams and requests byte by byte, from the description of the protocol, over a port
// that the test fills. What real sockets do: tests/command_line/udp_sensor_test.py.
#include "fieldbus/udp/datagram_sensor.hpp"

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <cstring>
#include <deque>
#include <thread>

#include "fieldbus/simulated/simulated_can_network.hpp"
#include "fieldbus/udp/udp_port.hpp"
#include "models/base/setup_error.hpp"
#include "tests/allocation_count.hpp"
#include "tests/source_file.hpp"

namespace proxarm::fieldbus {
namespace {

using description::SetupError;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using Bytes = std::vector<std::uint8_t>;

const Bytes stop{0x12, 0x34, 0, 0, 0, 0, 0, 0}, start{0x12, 0x34, 0, 2, 0, 0, 0, 0};

description::SensorDescription net_ft() {
  return description::load_sensor(source_file("models/sensors/ati_net_ft.yaml"));
}

// What the test has put on the wire, and what the sensor was told.
struct Wire {
  std::deque<Datagram> waiting;
  std::vector<Bytes> told;
  bool endless = false;  // the first one that waits comes again and again
  std::function<void(const Bytes&)> on_request = [](const Bytes&) {};

  void put(const Bytes& bytes, std::int64_t time_ns) {
    Datagram datagram;
    datagram.bytes = std::min(bytes.size(), datagram.data.size());
    std::copy_n(bytes.begin(), datagram.bytes, datagram.data.begin());
    datagram.time_ns = time_ns;
    waiting.push_back(datagram);
  }
};

class WirePort final : public DatagramPort {
 public:
  explicit WirePort(Wire& wire) : wire_(wire) {}
  bool send(std::span<const std::uint8_t> bytes) noexcept override {
    wire_.told.emplace_back(bytes.begin(), bytes.end());
    wire_.on_request(wire_.told.back());
    return true;
  }
  bool receive(Datagram& out, std::int64_t) noexcept override {
    if (wire_.waiting.empty()) return false;
    out = wire_.waiting.front();
    if (!wire_.endless) wire_.waiting.pop_front();
    return true;
  }

 private:
  Wire& wire_;
};

//                 RDT sequence    F/T sequence   status      Fx = 1.5 N              Fy = −2 N
Bytes datagram(std::uint32_t number, std::uint32_t status = 0, std::uint8_t last = 0) {
  const auto at = [](std::uint32_t word, int byte) { return static_cast<std::uint8_t>(word >> (24 - 8 * byte)); };
  Bytes bytes;
  for (int i = 0; i < 4; ++i) bytes.push_back(at(number, i));
  for (int i = 0; i < 4; ++i) bytes.push_back(at(7 * number, i));
  for (int i = 0; i < 4; ++i) bytes.push_back(at(status, i));
  const Bytes counts{0x00, 0x16, 0xE3, 0x60, 0xFF, 0xE1, 0x7B, 0x80,   // 1,500,000; −2,000,000
                     0x13, 0xAB, 0x66, 0x80, 0x00, 0x00, 0x00, 0x01,   // 330,000,000; 1
                     0xFF, 0xFF, 0xFF, 0xFF, 0x00, 0x0F, 0x42, last};  // −1; 1,000,000 less its last byte, 40h, + last
  bytes.insert(bytes.end(), counts.begin(), counts.end());
  return bytes;
}

struct NetFt : ::testing::Test {
  static constexpr std::int64_t cycle_ns = 1'000'000;

  Wire wire;
  DatagramSensor sensor{net_ft(), std::make_unique<WirePort>(wire), {.peer = "192.168.1.1, UDP port 49152"}};
  CanFrame unused;
  std::int64_t now_ns = 1'000'000'000;

  // A cycle before which these came.
  [[nodiscard]] bool cycle(const std::vector<Bytes>& came) {
    for (const Bytes& bytes : came) wire.put(bytes, now_ns - 1000);
    EXPECT_FALSE(sensor.poll(now_ns, unused)) << "nothing is for the CAN bus";
    now_ns += cycle_ns;
    return sensor.fresh();
  }
};

TEST_F(NetFt, ReadsSixSignedNumbersHighByteFirst) {
  ASSERT_TRUE(cycle({datagram(1, 0, 0x40)}));
  const double expected[] = {1.5, -2.0, 330.0, 1e-6, -1e-6, 1.0};
  for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(sensor.latest().wrench_S[i], expected[i], 1e-12) << i;
  EXPECT_EQ(sensor.latest().time_ns, now_ns - cycle_ns - 1000);
  EXPECT_TRUE(sensor.latest().healthy);
  EXPECT_FALSE(sensor.latest().saturated) << "330 N of 330";
}

TEST_F(NetFt, TakesTheNewestOfACycle) {
  ASSERT_TRUE(cycle({datagram(1, 0, 1), datagram(2, 0, 2), datagram(3, 0, 3)}));
  EXPECT_EQ(sensor.latest().number, 1u);
  EXPECT_NEAR(sensor.latest().wrench_S[5], 1.0 - 0.00006 - 0.000001, 1e-9) << "0F4203h is 999,939";
  EXPECT_EQ(sensor.counts(), DatagramCounts{});
}

TEST_F(NetFt, HasNoSampleWithoutADatagram) {
  ASSERT_TRUE(cycle({datagram(1)}));
  EXPECT_FALSE(cycle({}));
  EXPECT_TRUE(sensor.answered()) << "waiting is of no use";
  EXPECT_TRUE(cycle({datagram(2)}));
}

TEST_F(NetFt, DropsWhatIsntThirtySixBytesLong) {
  for (const std::size_t length : {0U, 1U, 35U, 37U, 64U, 65U, 1400U}) {
    Bytes bytes = datagram(1);
    bytes.resize(length);
    EXPECT_FALSE(cycle({bytes})) << length;
  }
  EXPECT_EQ(sensor.counts().wrong_lengths, 7u);
  EXPECT_THAT(sensor.describe_losses(), HasSubstr("7 datagrams of a wrong length"));
}

TEST_F(NetFt, CountsLostRepeatedAndLateDatagrams) {
  ASSERT_TRUE(cycle({datagram(10)}));
  ASSERT_TRUE(cycle({datagram(15)}));
  EXPECT_EQ(sensor.counts().lost, 4u);
  EXPECT_FALSE(cycle({datagram(15)}));
  EXPECT_EQ(sensor.counts().repeated, 1u);
  EXPECT_FALSE(cycle({datagram(12)}));
  EXPECT_EQ(sensor.counts().out_of_order, 1u);
  ASSERT_TRUE(cycle({datagram(16)}));
  EXPECT_EQ(sensor.counts().lost, 4u);
}

TEST_F(NetFt, GoesOnPastTheEndOfTheSequence) {
  ASSERT_TRUE(cycle({datagram(0xFFFFFFFF)}));
  ASSERT_TRUE(cycle({datagram(0)}));
  EXPECT_EQ(sensor.counts(), DatagramCounts{});
}

TEST_F(NetFt, FollowsASensorThatStartsAgain) {
  ASSERT_TRUE(cycle({datagram(1'000'000)}));
  EXPECT_FALSE(cycle({datagram(1)})) << "it might be an old one";
  EXPECT_TRUE(cycle({datagram(2)}));
  EXPECT_TRUE(cycle({datagram(3)}));
}

TEST_F(NetFt, DropsALateDatagramThatComesTwice) {
  ASSERT_TRUE(cycle({datagram(10)}));
  EXPECT_FALSE(cycle({datagram(9)}));
  EXPECT_FALSE(cycle({datagram(9)})) << "a repetition isn't a sensor that starts again";
  EXPECT_FALSE(cycle({datagram(8)}));
  EXPECT_EQ(sensor.counts().out_of_order, 2u);
  EXPECT_EQ(sensor.counts().repeated, 1u);
  EXPECT_TRUE(cycle({datagram(11)}));
  EXPECT_EQ(sensor.counts().lost, 0u);
}

TEST_F(NetFt, DropsLateDatagramsBetweenWhichTheSequenceShowsItself) {
  ASSERT_TRUE(cycle({datagram(10)}));
  EXPECT_FALSE(cycle({datagram(8)}));
  EXPECT_FALSE(cycle({datagram(10)}));
  EXPECT_FALSE(cycle({datagram(9)})) << "not in a row with 8";
}

TEST_F(NetFt, TellsEachBitOfTheStatusAsAnError) {
  for (int bit = 0; bit < 32; ++bit) {
    ASSERT_TRUE(cycle({datagram(static_cast<std::uint32_t>(bit + 1), 1U << bit)}));
    EXPECT_FALSE(sensor.latest().healthy) << bit;
  }
  EXPECT_THAT(sensor.describe_status(0x80010000), HasSubstr("status 0x80010000: monitor condition latched, error"));
}

TEST_F(NetFt, DropsWhatHasWaitedTooLong) {
  wire.put(datagram(1), now_ns - 20'000'001);
  EXPECT_FALSE(cycle({}));
  wire.put(datagram(2), now_ns - 19'999'000);
  EXPECT_TRUE(cycle({}));
}

TEST_F(NetFt, TakesNothingFromAFlood) {
  std::vector<Bytes> flood;
  for (int i = 0; i <= DatagramSensor::flood; ++i) flood.push_back(datagram(static_cast<std::uint32_t>(i)));
  EXPECT_FALSE(cycle(flood));
  EXPECT_THAT(sensor.describe_losses(), HasSubstr("1 cycles flooded"));
  EXPECT_TRUE(cycle({datagram(1000)}));
}

TEST_F(NetFt, AllocatesNothingInACycle) {
  wire.put(datagram(1), now_ns);
  const std::size_t before = tests::allocation_count();
  sensor.poll(now_ns, unused);
  EXPECT_EQ(tests::allocation_count(), before);
  EXPECT_TRUE(sensor.fresh());
}

TEST_F(NetFt, IsReplayedFromItsArchivedInput) {
  ASSERT_TRUE(cycle({datagram(1, 0, 0x40)}));
  std::array<std::byte, 512> room{};
  auto writer = StateArchive::writer(room);
  sensor.archive_input(writer);
  ASSERT_TRUE(writer.whole());
  Wire silent;
  DatagramSensor again(net_ft(), std::make_unique<WirePort>(silent), {.peer = "a record"});
  auto reader = StateArchive::reader({room.data(), writer.bytes()});
  again.archive_input(reader);
  again.poll(now_ns - cycle_ns, unused);
  ASSERT_TRUE(again.fresh());
  EXPECT_EQ(again.latest().wrench_S, sensor.latest().wrench_S);
  again.poll(now_ns, unused);
  EXPECT_FALSE(again.fresh()) << "one input is one sample";
}

struct NetFtAtStart : NetFt {
  SimulatedCanNetwork network{{}};

  // The sensor answers a start with this.
  void answer(const Bytes& bytes) {
    wire.on_request = [this, bytes](const Bytes& request) {
      if (request == start) wire.put(bytes, network.now_ns());
    };
  }
  [[nodiscard]] std::string refusal() {
    try {
      sensor.start(network, 0);
    } catch (const SetupError& error) {
      return error.what();
    }
    return "none";
  }
};

TEST_F(NetFtAtStart, StopsStartsAndStopsAtTheEnd) {
  {
    DatagramSensor own(net_ft(), std::make_unique<WirePort>(wire), {.peer = "x"});
    answer(datagram(1));
    own.start(network, 0);
    EXPECT_THAT(wire.told, ElementsAre(stop, start));
    EXPECT_THAT(own.identity(), HasSubstr("ATI Net F/T"));
  }
  EXPECT_THAT(wire.told, ElementsAre(stop, start, stop));
}

TEST_F(NetFtAtStart, SendsNothingIfItNeverStarted) {
  { const DatagramSensor own(net_ft(), std::make_unique<WirePort>(wire), {.peer = "x"}); }
  EXPECT_TRUE(wire.told.empty());
}

TEST_F(NetFtAtStart, AsksAgainForASecond) {
  EXPECT_THAT(refusal(), HasSubstr("no answer"));
  EXPECT_EQ(std::count(wire.told.begin(), wire.told.end(), start), 10);
  EXPECT_NEAR(1e-9 * static_cast<double>(network.now_ns()), 1.0, 0.1);
}

TEST_F(NetFtAtStart, EndsThoughDatagramsNeverEnd) {
  wire.endless = true;
  wire.put(datagram(1), 0);
  EXPECT_THAT(refusal(), HasSubstr("no answer"));
}

TEST_F(NetFtAtStart, RefusesAnotherSensorAndOneWithAnError) {
  answer(Bytes(48));
  EXPECT_THAT(refusal(), HasSubstr("10 datagrams of a wrong length"));
  answer(datagram(1, 0x80000000));
  EXPECT_THAT(refusal(), HasSubstr("status 0x80000000: error"));
}

TEST_F(NetFtAtStart, DoesntCountWhatWasLostWhileTheDrivesWereBroughtUp) {
  answer(datagram(1));
  sensor.start(network, 0);
  now_ns = network.now_ns() + cycle_ns;
  ASSERT_TRUE(cycle({datagram(5000)}));
  EXPECT_EQ(sensor.describe_losses(), "");
}

// ---- A checksum

struct CheckedSensor : ::testing::Test {
  Wire wire;
  SimulatedCanNetwork network{{}};
  DatagramSensor sensor{description::load_sensor(source_file("models/schema/specimens/sensor/11_datagrams.yaml")),
                        std::make_unique<WirePort>(wire),
                        {.peer = "x"}};

  // 40 bytes: a counter in byte 24, and the sum of all others in the last two.
  static Bytes checked(std::uint8_t number, std::uint8_t sum) {
    Bytes bytes(40);
    bytes[24] = number;
    bytes[38] = sum;
    return bytes;
  }
  void answer(const std::vector<Bytes>& answers) {
    wire.on_request = [this, answers, next = std::size_t{0}](const Bytes& request) mutable {
      if (request == Bytes{1}) wire.put(answers[std::min(next++, answers.size() - 1)], network.now_ns());
    };
  }
};

TEST_F(CheckedSensor, IsRefusedWithBadChecksumsAlone) {
  answer({checked(5, 6)});
  try {
    sensor.start(network, 0);
    FAIL() << "no datagram was good";
  } catch (const SetupError& error) {
    EXPECT_THAT(error.what(), HasSubstr("10 datagrams with a bad checksum"));
    EXPECT_THAT(error.what(), Not(HasSubstr("firewall")));
  }
}

TEST_F(CheckedSensor, TellsBadChecksumsAsLosses) {
  answer({checked(5, 6), checked(6, 6)});
  sensor.start(network, 0);
  EXPECT_EQ(sensor.describe_losses(), "") << "one was bad before the start was over";
  CanFrame unused;
  for (const std::uint8_t number : {std::uint8_t{7}, std::uint8_t{8}}) {
    wire.put(checked(number, 0), network.now_ns());
    (void)sensor.poll(network.now_ns(), unused);
    EXPECT_FALSE(sensor.fresh());
  }
  EXPECT_THAT(sensor.describe_losses(), HasSubstr("2 datagrams with a bad checksum"));
}

TEST(DatagramSensorFile, IsRefusedWithoutDatagrams) {
  Wire wire;
  EXPECT_THROW(DatagramSensor(description::load_sensor(source_file("models/sensors/aidin_aft200.yaml")),
                              std::make_unique<WirePort>(wire), {}),
               SetupError);
}

// ---- The kernel's sockets

struct Loopback : ::testing::Test {
  Loopback() {
    descriptor = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    bind_to(descriptor, port);
    const timeval patience{.tv_sec = 5, .tv_usec = 0};
    setsockopt(descriptor, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  }
  ~Loopback() override { close(descriptor); }

  static void bind_to(int socket, int& port) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    EXPECT_EQ(bind(socket, reinterpret_cast<const sockaddr*>(&address), size), 0);
    EXPECT_EQ(getsockname(socket, reinterpret_cast<sockaddr*>(&address), &size), 0);
    port = ntohs(address.sin_port);
  }
  // Takes a datagram; the next answer goes to its sender.
  [[nodiscard]] Bytes take() {
    Bytes bytes(100);
    socklen_t size = sizeof peer;
    const ssize_t count =
        recvfrom(descriptor, bytes.data(), bytes.size(), 0, reinterpret_cast<sockaddr*>(&peer), &size);
    bytes.resize(static_cast<std::size_t>(std::max<ssize_t>(count, 0)));
    return bytes;
  }
  void answer(const Bytes& bytes, int from) const {
    EXPECT_EQ(sendto(from, bytes.data(), bytes.size(), 0, reinterpret_cast<const sockaddr*>(&peer), sizeof peer),
              static_cast<ssize_t>(bytes.size()));
  }
  static bool await(DatagramPort& port, Datagram& out) {
    for (int i = 0; i < 500; ++i) {
      if (port.receive(out, 0)) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return false;
  }

  int descriptor = -1, port = 0;
  sockaddr_in peer{};
};

TEST_F(Loopback, CarriesDatagramsBothWaysWithTheTimeOfArrival) {
  const auto own = open_udp({"127.0.0.1", port});
  // Returns the age of a datagram that was read 20 ms after it had been sent.
  const auto age_of = [&](std::uint32_t number) {
    EXPECT_TRUE(own->send(start));
    EXPECT_EQ(take(), start);
    answer(datagram(number), descriptor);
    Datagram read;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    EXPECT_TRUE(await(*own, read));
    EXPECT_EQ(Bytes(read.view().begin(), read.view().end()), datagram(number));
    timespec now{};
    clock_gettime(CLOCK_MONOTONIC, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec) -
           1e-9 * static_cast<double>(read.time_ns);
  };
  // Linux begins to stamp by a work queue (net_enable_timestamp), which waits for a busy machine. Until then a datagram
  // has the time at which it was read.
  std::uint32_t number = 1;
  while (age_of(number) < 0.019 && number < 100) ++number;
  for (int i = 0; i < 3; ++i) {
    const double age_s = age_of(++number);
    EXPECT_GE(age_s, 0.019);
    EXPECT_LT(age_s, 10.0);
  }
}

TEST_F(Loopback, HearsNoStranger) {
  const auto own = open_udp({"127.0.0.1", port});
  ASSERT_TRUE(own->send(start));
  ASSERT_EQ(take(), start);
  const int stranger = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  int strangers_port = 0;
  bind_to(stranger, strangers_port);
  answer(datagram(7), stranger);
  answer(datagram(1), descriptor);
  Datagram read;
  ASSERT_TRUE(await(*own, read));
  EXPECT_EQ(read.data[3], 1) << "the stranger's came first";
  EXPECT_FALSE(own->receive(read, 0));
  close(stranger);
}

TEST_F(Loopback, ShowsADatagramThatIsTooLong) {
  const auto own = open_udp({"127.0.0.1", port});
  ASSERT_TRUE(own->send(start));
  ASSERT_EQ(take(), start);
  answer(Bytes(60'000), descriptor);
  Datagram read;
  ASSERT_TRUE(await(*own, read));
  EXPECT_EQ(read.bytes, Datagram::most_bytes);
}

TEST_F(Loopback, GoesOnAfterNobodyListened) {
  const int other = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  int unused_port = 0;
  bind_to(other, unused_port);
  close(other);
  const auto own = open_udp({"127.0.0.1", unused_port});
  Datagram read;
  for (int i = 0; i < 5; ++i) {
    EXPECT_TRUE(own->send(start)) << i;
    EXPECT_FALSE(own->receive(read, 0));
  }
}

// RFC 792: type 3, code, checksum, 4 unused bytes, then IP header and UDP ports of the datagram that was refused.
Bytes destination_unreachable(std::uint8_t code, const sockaddr_in& from, const sockaddr_in& to) {
  Bytes bytes(36);
  bytes[0] = 3;
  bytes[1] = code;
  bytes[8] = 0x45;  // IPv4, a header of 5 words
  bytes[11] = 28;   // total length
  bytes[16] = 64;   // time to live
  bytes[17] = 17;   // UDP
  bytes[33] = 8;    // UDP length
  std::memcpy(&bytes[20], &from.sin_addr, 4);
  std::memcpy(&bytes[24], &to.sin_addr, 4);
  std::memcpy(&bytes[28], &from.sin_port, 2);
  std::memcpy(&bytes[30], &to.sin_port, 2);
  std::uint32_t sum = 0;
  for (std::size_t i = 0; i < bytes.size(); i += 2) sum += static_cast<std::uint32_t>(bytes[i] << 8 | bytes[i + 1]);
  sum = ~((sum & 0xFFFF) + (sum >> 16));
  bytes[2] = static_cast<std::uint8_t>(sum >> 8);
  bytes[3] = static_cast<std::uint8_t>(sum);
  return bytes;
}

TEST_F(Loopback, ReadsWhatWaitsBehindAnyIcmpError) {
  const int raw = ::socket(AF_INET, SOCK_RAW | SOCK_CLOEXEC, IPPROTO_ICMP);
  if (raw < 0) GTEST_SKIP() << "only root may send ICMP messages";
  const auto own = open_udp({"127.0.0.1", port});
  ASSERT_TRUE(own->send(start));
  ASSERT_EQ(take(), start);
  sockaddr_in sensor{};
  socklen_t size = sizeof sensor;
  ASSERT_EQ(getsockname(descriptor, reinterpret_cast<sockaddr*>(&sensor), &size), 0);
  // Protocol, port, network and host unknown, host isolated, network prohibited, prohibited by a filter.
  for (const int code : {2, 3, 6, 7, 8, 9, 13}) {
    answer(datagram(1), descriptor);
    const Bytes message = destination_unreachable(static_cast<std::uint8_t>(code), peer, sensor);
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_addr = peer.sin_addr;
    ASSERT_EQ(sendto(raw, message.data(), message.size(), 0, reinterpret_cast<const sockaddr*>(&to), sizeof to), 36);
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    Datagram read;
    EXPECT_TRUE(own->receive(read, 0)) << code;
    EXPECT_FALSE(own->receive(read, 0)) << code;
  }
  close(raw);
}

TEST(UdpPeers, OnLoopbackAloneUnlessTheUserSaidSo) {
  for (const char* host : {"127.0.0.1", "127.255.255.254"}) EXPECT_TRUE(is_on_this_machine({host, 1})) << host;
  for (const char* host : {"128.0.0.1", "192.168.1.1", "10.0.0.1", "0.0.0.0", "localhost", ""}) {
    EXPECT_FALSE(is_on_this_machine({host, 1})) << host;
    EXPECT_THROW((void)open_udp({host, 1}), SetupError) << host;
  }
}

}  // namespace
}  // namespace proxarm::fieldbus
