// The Robotiq FT 300 by its file: bytes from the maker's register table (180 to 185, signed, N/100 and Nm/1000), and
// the simulated one on a pseudo-terminal, through libmodbus.
#include "fieldbus/modbus/modbus_sensor.hpp"

#include <gmock/gmock.h>

#include "models/base/setup_error.hpp"
#include "sim/devices/modbus_sensor_device.hpp"
#include "sim/devices/modbus_server.hpp"
#include "tests/source_file.hpp"

namespace proxarm::sim {
namespace {

using fieldbus::ModbusMessage;
using fieldbus::ModbusResult;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

description::SensorDescription ft300() {
  return description::load_sensor(source_file("models/sensors/robotiq_ft300.yaml"));
}

// Says what it is told to.
class ScriptedClient final : public fieldbus::ModbusClient {
 public:
  std::vector<std::uint8_t> request;
  std::vector<std::uint8_t> answer;  // empty: none

 private:
  ModbusResult transact(const ModbusMessage& asked, ModbusMessage& told) noexcept override {
    request.assign(asked.bytes.begin(), asked.bytes.begin() + static_cast<std::ptrdiff_t>(asked.size));
    if (answer.empty()) return ModbusResult::timeout;
    std::copy(answer.begin(), answer.end(), told.bytes.begin());
    told.size = answer.size();
    return ModbusResult::ok;
  }
};

struct Ft300 : ::testing::Test {
  ScriptedClient client;
  fieldbus::ModbusSensor sensor{ft300(), 9, "ft"};
  fieldbus::CanFrame unused;

  [[nodiscard]] bool sample(std::int64_t time_ns) {
    sensor.exchange(client, time_ns);
    EXPECT_FALSE(sensor.poll(time_ns + 100'000, unused)) << "nothing is for the CAN bus";
    return sensor.fresh();
  }
};

TEST_F(Ft300, AsksForSixRegistersAndReadsThem) {
  //             unit  03  bytes   −1.00 N     12.34 N    −123.45 N    0.5 Nm    −0.001 Nm    30.1 Nm
  client.answer = {9, 3, 12, 0xFF, 0x9C, 0x04, 0xD2, 0xCF, 0xC7, 0x01, 0xF4, 0xFF, 0xFF, 0x75, 0x94};
  ASSERT_TRUE(sample(1'000'000));
  EXPECT_THAT(client.request, ElementsAre(9, 3, 0x00, 0xB4, 0x00, 0x06));
  const fieldbus::ForceSample& read = sensor.latest();
  const double expected[] = {-1.0, 12.34, -123.45, 0.5, -0.001, 30.1};
  for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(read.wrench_S[i], expected[i], 1e-12) << i;
  EXPECT_EQ(read.time_ns, 1'000'000);
  EXPECT_TRUE(read.saturated) << "30.1 Nm of 30";
}

TEST_F(Ft300, HasNoSampleWithoutAnAnswer) {
  client.answer = {9, 3, 12, 0, 1, 0, 2, 0, 3, 0, 4, 0, 5, 0, 6};
  ASSERT_TRUE(sample(1'000'000));
  sensor.poll(2'000'000, unused);
  EXPECT_FALSE(sensor.fresh()) << "one answer is one sample";
  for (const std::vector<std::uint8_t>& bad :
       {std::vector<std::uint8_t>{},                   // none
        std::vector<std::uint8_t>{9, 0x83, 4},         // an exception
        std::vector<std::uint8_t>{9, 3, 12, 0, 1, 0},  // half of one
        std::vector<std::uint8_t>{10, 3, 12, 0, 1, 0, 2, 0, 3, 0, 4, 0, 5, 0, 6}}) {
    client.answer = bad;
    EXPECT_FALSE(sample(3'000'000));
  }
  EXPECT_THROW(sensor.start_up(client, 0), description::SetupError);
}

TEST_F(Ft300, TellsOfASensorThatRepeatsItself) {
  client.answer = {9, 3, 12, 0, 1, 0, 2, 0, 3, 0, 4, 0, 5, 0, 6};
  for (int i = 1; i <= 5; ++i) ASSERT_TRUE(sample(20'000'000 * i));
  EXPECT_EQ(sensor.latest().repeats, 4u);
}

TEST(ModbusSensorFile, IsRefusedWhereItsRegistersCantBe) {
  EXPECT_THROW(fieldbus::ModbusSensor(ft300(), 0, "ft"), description::SetupError);
  EXPECT_THROW(fieldbus::ModbusSensor(ft300(), 248, "ft"), description::SetupError);
  EXPECT_THROW(
      fieldbus::ModbusSensor(description::load_sensor(source_file("models/sensors/aidin_aft200.yaml")), 9, "ft"),
      description::SetupError);
}

// The simulated one at the end of a pseudo-terminal: libmodbus' framing and checksums on one side, the server's on the
// other.
TEST(ModbusSensorOnAPty, IsReadAndNotReadWhenSilent) {
  const description::SensorDescription sensor = ft300();
  ModbusSensorDevice device(*sensor.described->registers, 9);
  fieldbus::CanFrame sample;
  sample.fd = true;
  sample.length = 12;
  sample.data[0] = 0xFF;
  sample.data[1] = 0x38;   // −2.00 N
  sample.data[11] = 0x64;  // 0.1 Nm
  device.send(sample, 0);
  description::ModbusLineDescription line;
  line.name = "ft";
  line.baud = 19200;
  line.parity = "none";  // a pseudo-terminal has none
  ModbusServer server(line, {&device});
  line.device = server.device();
  const auto client = fieldbus::open_modbus(line, 1.0);  // patient with a busy machine
  fieldbus::ModbusSensor reader(sensor, 9, "ft");
  reader.start_up(*client, 0);
  reader.exchange(*client, 1'000'000);
  fieldbus::CanFrame unused;
  reader.poll(1'100'000, unused);
  ASSERT_TRUE(reader.fresh());
  EXPECT_NEAR(reader.latest().wrench_S[0], -2.0, 1e-12);
  EXPECT_NEAR(reader.latest().wrench_S[5], 0.1, 1e-12);
  EXPECT_THAT(reader.identity(), HasSubstr("Robotiq FT 300"));
  device.set_silent(true);
  const auto impatient = fieldbus::open_modbus(line, 0.05);
  reader.exchange(*impatient, 2'000'000);
  reader.poll(2'100'000, unused);
  EXPECT_FALSE(reader.fresh());
}

}  // namespace
}  // namespace proxarm::sim
