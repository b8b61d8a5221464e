// Modbus as bytes: the examples of the MODBUS Application Protocol Specification V1.1b3, answers that aren't any, and
// what a drive is told by the two register maps that are shipped.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <deque>

#include "fieldbus/modbus/modbus_drive.hpp"
#include "fieldbus/modbus/modbus_line.hpp"
#include "models/base/setup_error.hpp"
#include "models/files/yaml_file.hpp"
#include "tests/scratch_folder.hpp"
#include "tests/source_file.hpp"

namespace proxarm::fieldbus {
namespace {

using description::DriveDescription;
using description::ModbusDriveDescription;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::ElementsAreArray;
using ::testing::HasSubstr;
using tests::ScratchFolder;
using Bytes = std::vector<std::uint8_t>;

Bytes bytes_of(const ModbusMessage& message) { return {message.span().begin(), message.span().end()}; }

// The specification's examples are PDUs; the unit before them is 11h here.
TEST(ModbusPdu, ReadsHoldingRegistersAsInSection6_3) {
  const ModbusMessage request = encode_read(0x11, 0x006B, 3);
  EXPECT_THAT(bytes_of(request), ElementsAre(0x11, 0x03, 0x00, 0x6B, 0x00, 0x03));
  std::array<std::uint16_t, 3> values{};
  int exception = 0;
  const Bytes answer{0x11, 0x03, 0x06, 0x02, 0x2B, 0x00, 0x00, 0x00, 0x64};
  EXPECT_EQ(decode_answer(request.span(), answer, values, exception), ModbusResult::ok);
  EXPECT_THAT(values, ElementsAre(0x022B, 0x0000, 0x0064));
}

TEST(ModbusPdu, WritesRegistersAsInSection6_12) {
  const std::array<std::uint16_t, 2> values{0x000A, 0x0102};
  const ModbusMessage request = encode_write(0x11, 0x0001, values);
  EXPECT_THAT(bytes_of(request), ElementsAre(0x11, 0x10, 0x00, 0x01, 0x00, 0x02, 0x04, 0x00, 0x0A, 0x01, 0x02));
  int exception = 0;
  const Bytes answer{0x11, 0x10, 0x00, 0x01, 0x00, 0x02};
  EXPECT_EQ(decode_answer(request.span(), answer, {}, exception), ModbusResult::ok);
  const Bytes another_count{0x11, 0x10, 0x00, 0x01, 0x00, 0x01};
  EXPECT_EQ(decode_answer(request.span(), another_count, {}, exception), ModbusResult::malformed);
}

TEST(ModbusPdu, ReadsAndWritesAsInSection6_17) {
  const std::array<std::uint16_t, 3> written{0x00FF, 0x00FF, 0x00FF};
  const ModbusMessage request = encode_read_write(0x11, 0x0003, 6, 0x000E, written);
  EXPECT_THAT(bytes_of(request), ElementsAre(0x11, 0x17, 0x00, 0x03, 0x00, 0x06, 0x00, 0x0E, 0x00, 0x03, 0x06, 0x00,
                                             0xFF, 0x00, 0xFF, 0x00, 0xFF));
  std::array<std::uint16_t, 6> values{};
  int exception = 0;
  const Bytes answer{0x11, 0x17, 0x0C, 0x00, 0xFE, 0x0A, 0xCD, 0x00, 0x01, 0x00, 0x03, 0x00, 0x0D, 0x00, 0xFF};
  EXPECT_EQ(decode_answer(request.span(), answer, values, exception), ModbusResult::ok);
  EXPECT_THAT(values, ElementsAre(0x00FE, 0x0ACD, 0x0001, 0x0003, 0x000D, 0x00FF));
}

TEST(ModbusPdu, TellsWhatIsWrongWithAnAnswer) {
  const ModbusMessage request = encode_read(0x11, 0x006B, 2);
  std::array<std::uint16_t, 2> values{7, 7};
  int exception = 0;
  const auto decoded = [&](const Bytes& answer) { return decode_answer(request.span(), answer, values, exception); };
  EXPECT_EQ(decoded({0x11, 0x83, 0x02}), ModbusResult::exception);
  EXPECT_EQ(exception, 2);
  EXPECT_STREQ(modbus_exception_name(exception), "illegal data address");
  EXPECT_EQ(decoded({0x12, 0x03, 0x04, 0, 1, 0, 2}), ModbusResult::wrong_unit);
  EXPECT_EQ(decoded({0x11, 0x04, 0x04, 0, 1, 0, 2}), ModbusResult::malformed);
  EXPECT_EQ(decoded({0x11, 0x03, 0x04, 0, 1}), ModbusResult::malformed);        // half of it
  EXPECT_EQ(decoded({0x11, 0x03, 0x02, 0, 1, 0, 2}), ModbusResult::malformed);  // another count
  EXPECT_EQ(decoded({0x11, 0x03, 0x04, 0, 1, 0, 2, 0}), ModbusResult::malformed);
  EXPECT_EQ(decoded({0x11, 0x83}), ModbusResult::malformed);
  EXPECT_EQ(decoded({}), ModbusResult::malformed);
  EXPECT_THAT(values, ElementsAre(7, 7));
}

// ---- a drive against a line of typed bytes --------------------------------------------------------------------------

class TypedLine final : public ModbusClient {
 public:
  std::vector<Bytes> requests;
  std::deque<std::pair<ModbusResult, Bytes>> answers;

 private:
  ModbusResult transact(const ModbusMessage& request, ModbusMessage& answer) noexcept override {
    requests.push_back(bytes_of(request));
    if (answers.empty()) return ModbusResult::timeout;
    const auto [result, bytes] = answers.front();
    answers.pop_front();
    std::copy(bytes.begin(), bytes.end(), answer.bytes.begin());
    answer.size = bytes.size();
    return result;
  }
};

DriveDescription linear_axis() {
  DriveDescription drive;
  drive.joint = "rail";
  drive.bus = "line";
  drive.node = 1;
  drive.profile = "modbus";
  drive.counts_per_motor_revolution = 2.0 * M_PI * 1000.0;  // 1000 counts per metre
  drive.gear_ratio = 1.0;
  drive.range_rad = {-10.0, 10.0};
  return drive;
}

ModbusDriveDescription shipped(const std::string& name) {
  return description::load_modbus_drive(source_file("models/drives") / name);
}

constexpr std::int64_t ms = 1'000'000;

class GenericDrive : public ::testing::Test {
 protected:
  // Status and position, in registers 16, 17, 18.
  void answer(std::uint8_t status, std::int16_t position) {
    const auto high = static_cast<std::uint8_t>(position < 0 ? 0xFF : 0);
    line.answers.push_back({ModbusResult::ok,
                            {1, line_function, 6, 0, status, high, high, static_cast<std::uint8_t>(position >> 8),
                             static_cast<std::uint8_t>(position)}});
  }
  void start() {
    line.answers.push_back({ModbusResult::ok, {1, 16, 0, 32, 0, 1}});
    line.answers.push_back({ModbusResult::ok, {1, 3, 2, 0, 60}});
    line_function = 3;
    answer(1, 500);
    drive.start_up(line, 0);
    line_function = 23;
  }
  void enable() {
    start();
    drive.request(DriveGoal::operation_enabled);
    drive.on_sync(1 * ms);
    EXPECT_FALSE(drive.set_target_rad(0.0));
    answer(3, 500);
    EXPECT_TRUE(drive.exchange(line, 2 * ms, 5 * ms));
    drive.on_sync(3 * ms);
  }

  TypedLine line;
  ModbusDrive drive{linear_axis(), shipped("generic_absolute.yaml"), 1 * ms};
  std::uint8_t line_function = 23;
};

TEST_F(GenericDrive, IsSetUpEnabledAndMoved) {
  enable();
  // Setting 32 = 60 ms written and read back; registers 16..18; then control 1, position 500, lowest speed.
  ASSERT_EQ(line.requests.size(), 4u);
  EXPECT_THAT(line.requests[0], ElementsAre(1, 16, 0, 32, 0, 1, 2, 0, 60));
  EXPECT_THAT(line.requests[1], ElementsAre(1, 3, 0, 32, 0, 1));
  EXPECT_THAT(line.requests[2], ElementsAre(1, 3, 0, 16, 0, 3));
  EXPECT_THAT(line.requests[3], ElementsAre(1, 23, 0, 16, 0, 3, 0, 0, 0, 5, 10, 0, 1, 0, 0, 0x01, 0xF4, 0, 0, 0, 1));
  EXPECT_TRUE(drive.following());
  EXPECT_DOUBLE_EQ(drive.target_rad(), 0.5);

  // 0.5 m → 0.502 m in one cycle of 1 ms is 2 m/s, 2000 counts/s. Setpoint of t = 4 ms is meant for 6 ms; an exchange
  // at 5 ms arrives at 10 ms: 4 ms · 2000/s = 8 counts further, 510. 10 counts in 5 ms: 2000/s.
  EXPECT_TRUE(drive.set_target_rad(0.500));
  drive.on_sync(4 * ms);
  EXPECT_TRUE(drive.set_target_rad(0.502));
  EXPECT_EQ(drive.target_counts(), 502);
  answer(3, 500);
  EXPECT_TRUE(drive.exchange(line, 5 * ms, 5 * ms));
  EXPECT_THAT(line.requests[4],
              ElementsAre(1, 23, 0, 16, 0, 3, 0, 0, 0, 5, 10, 0, 1, 0, 0, 0x01, 0xFE, 0, 0, 0x07, 0xD0));
}

TEST_F(GenericDrive, ExtrapolatesByTwoExchangesAtMostAndThenFallsSilent) {
  enable();
  drive.set_target_rad(0.500);
  drive.on_sync(4 * ms);
  drive.set_target_rad(0.502);
  answer(3, 500);
  EXPECT_TRUE(drive.exchange(line, 40 * ms, 5 * ms));  // 502 + 10 ms · 2000/s = 522
  EXPECT_EQ(line.requests.back()[15], 0x02);
  EXPECT_EQ(line.requests.back()[16], 0x0A);
  const std::size_t sent = line.requests.size();
  EXPECT_FALSE(drive.exchange(line, 65 * ms, 5 * ms)) << "the cycle is gone for more than 60 ms";
  EXPECT_EQ(line.requests.size(), sent);
}

TEST_F(GenericDrive, KeepsToTheJointsRange) {
  enable();
  drive.set_target_rad(9.999);
  drive.on_sync(4 * ms);
  drive.set_target_rad(10.0);
  answer(3, 500);
  EXPECT_TRUE(drive.exchange(line, 20 * ms, 5 * ms));
  EXPECT_EQ(line.requests.back()[15] << 8 | line.requests.back()[16], 10000);
}

TEST_F(GenericDrive, IsSwitchedOffByItsControlWord) {
  enable();
  drive.request(DriveGoal::switched_off);
  drive.on_sync(4 * ms);
  EXPECT_FALSE(drive.set_target_rad(0.6));
  answer(1, 500);
  drive.exchange(line, 5 * ms, 5 * ms);
  EXPECT_EQ(line.requests.back()[12], 0) << "control word";
  drive.on_sync(6 * ms);
  EXPECT_NE(drive.state(), DriveState::operation_enabled);
  EXPECT_EQ(drive.fault(), DriveFault::none);
}

TEST(GenericDriveOnALine, NamesFaultsOfTheWire) {
  const auto fault_after = [](ModbusResult result, const Bytes& bytes) {
    TypedLine line;
    ModbusDrive drive(linear_axis(), shipped("generic_absolute.yaml"), 1 * ms);
    line.answers.push_back({ModbusResult::ok, {1, 16, 0, 32, 0, 1}});
    line.answers.push_back({ModbusResult::ok, {1, 3, 2, 0, 60}});
    line.answers.push_back({ModbusResult::ok, {1, 3, 6, 0, 3, 0, 0, 0, 0}});
    drive.start_up(line, 0);
    drive.request(DriveGoal::operation_enabled);
    drive.on_sync(1 * ms);
    drive.set_target_rad(0.0);
    line.answers.push_back({result, bytes});
    drive.exchange(line, 2 * ms, 5 * ms);
    drive.on_sync(3 * ms);
    return std::pair(drive.fault(), drive.describe());
  };
  EXPECT_THAT(fault_after(ModbusResult::ok, {1, 23 | 0x80, 4}).second,
              HasSubstr("refused a Modbus request with an exception 4 (server device failure)"));
  EXPECT_EQ(fault_after(ModbusResult::ok, {2, 23, 6, 0, 3, 0, 0, 0, 0}).first, DriveFault::modbus_wrong_unit);
  EXPECT_EQ(fault_after(ModbusResult::closed, {}).first, DriveFault::modbus_closed);
  EXPECT_EQ(fault_after(ModbusResult::ok, {1, 23, 6, 0, 8, 0, 0, 0, 0}).first, DriveFault::state_fault);
  // Noise on the line: one answer may be missing or spoilt.
  EXPECT_EQ(fault_after(ModbusResult::timeout, {}).first, DriveFault::none);
  EXPECT_EQ(fault_after(ModbusResult::ok, {1, 23, 6, 0, 3}).first, DriveFault::none);
}

// A gateway's "server device busy" asks to be asked again: one is noise on the line, as a late answer is.
TEST_F(GenericDrive, ABusyGatewayIsAskedAgainUntilTheDriveIsLost) {
  enable();
  drive.set_target_rad(0.5);
  line.answers.push_back({ModbusResult::ok, {1, 23 | 0x80, 6}});
  EXPECT_TRUE(drive.exchange(line, 5 * ms, 5 * ms));
  drive.on_sync(6 * ms);
  EXPECT_EQ(drive.fault(), DriveFault::none);
  drive.set_target_rad(0.5);
  answer(3, 500);
  EXPECT_TRUE(drive.exchange(line, 10 * ms, 5 * ms));
  for (std::int64_t t_ms = 15; t_ms <= 75; t_ms += 5) {
    drive.on_sync(t_ms * ms);
    drive.set_target_rad(0.5);
    line.answers.push_back({ModbusResult::ok, {1, 23 | 0x80, 6}});
    EXPECT_TRUE(drive.exchange(line, t_ms * ms, 5 * ms));
  }
  drive.on_sync(76 * ms);
  EXPECT_EQ(drive.fault(), DriveFault::modbus_timeout) << "60 ms without an answer";
}

TEST_F(GenericDrive, ABusyGatewayIsAskedAgainAtTheStart) {
  line.answers.push_back({ModbusResult::ok, {1, 16 | 0x80, 6}});
  line.answers.push_back({ModbusResult::ok, {1, 16, 0, 32, 0, 1}});
  line.answers.push_back({ModbusResult::ok, {1, 3, 2, 0, 60}});
  line.answers.push_back({ModbusResult::ok, {1, 3 | 0x80, 6}});
  line.answers.push_back({ModbusResult::ok, {1, 3, 6, 0, 1, 0, 0, 0x01, 0xF4}});
  EXPECT_NO_THROW(drive.start_up(line, 0));
  EXPECT_EQ(line.requests.size(), 5u);
}

// Range: 10 m to both sides, 10,000 counts. The words of a position, high word first by the file.
TEST(GenericDriveOnALine, JudgesTheOrderOfWordsByItsFirstPosition) {
  const auto started = [](const Bytes& position) {
    TypedLine line;
    ModbusDrive drive(linear_axis(), shipped("generic_absolute.yaml"), 1 * ms);
    line.answers.push_back({ModbusResult::ok, {1, 16, 0, 32, 0, 1}});
    line.answers.push_back({ModbusResult::ok, {1, 3, 2, 0, 60}});
    Bytes answer{1, 3, 6, 0, 1};
    answer.insert(answer.end(), position.begin(), position.end());
    line.answers.push_back({ModbusResult::ok, answer});
    drive.start_up(line, 0);
    return drive.word_order_shown();
  };
  EXPECT_TRUE(started({0x00, 0x00, 0x01, 0xF4})) << "500; the other way round 32,768,000";
  EXPECT_TRUE(started({0xFF, 0xFF, 0xFE, 0x0C})) << "-500";
  EXPECT_FALSE(started({0, 0, 0, 0})) << "0 either way";
  EXPECT_FALSE(started({0xFF, 0xFF, 0xFF, 0xFF})) << "-1 either way";
  EXPECT_FALSE(started({0x12, 0x34, 0x56, 0x78})) << "out of range either way: the cycle refuses it";
  try {
    (void)started({0x01, 0xF4, 0x00, 0x00});
    FAIL() << "started";
  } catch (const description::SetupError& error) {
    EXPECT_THAT(error.what(),
                HasSubstr("found 32768000 counts, out of range_rad; with the words in the other order 500"));
    EXPECT_THAT(error.what(), HasSubstr("is word_order in "));
  }
}

TEST_F(GenericDrive, IsLostAfterItsTime) {
  enable();
  drive.on_sync(62 * ms);
  EXPECT_EQ(drive.fault(), DriveFault::none);
  EXPECT_TRUE(drive.fresh());
  drive.on_sync(63 * ms);
  EXPECT_FALSE(drive.fresh());
  EXPECT_EQ(drive.fault(), DriveFault::modbus_timeout);
}

TEST_F(GenericDrive, ASettingThatIsNotTakenIsRefused) {
  line.answers.push_back({ModbusResult::ok, {1, 16, 0, 32, 0, 1}});
  line.answers.push_back({ModbusResult::ok, {1, 3, 2, 0, 50}});
  try {
    drive.start_up(line, 0);
    FAIL();
  } catch (const description::SetupError& error) {
    EXPECT_THAT(error.what(), HasSubstr("communication timeout, register 32, read back: found 50, expected 60"));
  }
}

// Oriental Motor AZ: registers 0058h..0067h in one go, trigger last; position from 0120h; status 007Eh apart.
TEST(OrientalMotorAz, IsMovedByDirectDataOperation) {
  TypedLine line;
  ModbusDrive drive(linear_axis(), shipped("oriental_motor_az.yaml"), 1 * ms);
  line.answers.push_back({ModbusResult::ok, {1, 3, 8, 0, 0, 0x01, 0xF4, 0, 0, 0, 0}});  // 500
  line.answers.push_back({ModbusResult::ok, {1, 3, 4, 0, 0, 0, 0x20}});                 // READY
  drive.start_up(line, 0);
  EXPECT_THAT(line.requests[0], ElementsAre(1, 3, 0x01, 0x20, 0, 4));
  EXPECT_THAT(line.requests[1], ElementsAre(1, 3, 0x00, 0x7E, 0, 2));
  drive.request(DriveGoal::operation_enabled);
  drive.on_sync(1 * ms);
  ASSERT_TRUE(drive.following());
  drive.set_target_rad(0.5);
  drive.on_sync(2 * ms);
  drive.set_target_rad(0.501);
  line.answers.push_back({ModbusResult::ok, {1, 23, 8, 0, 0, 0x01, 0xF4, 0, 0, 0, 0}});
  drive.exchange(line, 4 * ms, 20 * ms);  // meant for 4 ms, there at 24 ms: 20 ms · 1000/s = 20 further, 521
  const Bytes expected{1,    23,   0x01, 0x20, 0, 4, 0x00, 0x58, 0, 16, 32,  // read 0120h, write 0058h, 16 registers
                       0,    0,    0,    0,                                  // data number 0
                       0,    0,    0,    1,                                  // absolute positioning
                       0,    0,    0x02, 0x09,                               // 521
                       0,    0,    0x04, 0x1A,                               // 21 counts in 20 ms: 1050 Hz
                       0x00, 0x0F, 0x42, 0x40,                               // 1000 kHz/s
                       0x00, 0x0F, 0x42, 0x40,                               // 1000 kHz/s
                       0,    0,    0x03, 0xE8,                               // 100.0 %
                       0,    0,    0,    1};                                 // trigger: all data
  EXPECT_THAT(line.requests.back(), ElementsAreArray(expected));
}

// Facts of the wire: function 23 at 115,200 baud for one axis takes about 6 ms, 3.5 of them silence.
TEST(ModbusRate, OfASerialLineIsWhatItsBaudCarries) {
  description::ModbusLineDescription line;
  line.baud = 115200;
  line.parity = "even";
  const ModbusDriveDescription drive = shipped("generic_absolute.yaml");
  // 13 + 10 + 5 + 6 = 34 characters of 11 bits: 3.25 ms, and twice 1.75 ms.
  EXPECT_NEAR(modbus_rtu_exchange_s(drive, line), 34.0 * 11.0 / 115200.0 + 3.5e-3, 1e-12);
  EXPECT_NEAR(modbus_expected_rate_Hz(drive, line, 6), 1.0 / (6.0 * 6.7465e-3), 0.01);
  line.host = "127.0.0.1";
  EXPECT_DOUBLE_EQ(modbus_expected_rate_Hz(drive, line, 6), 200.0);
}

TEST(ModbusRate, IsMeasured) {
  TypedLine line;
  ModbusDrive drive(linear_axis(), shipped("generic_absolute.yaml"), 1 * ms);
  for (int k = 1; k <= 100; ++k) {
    line.answers.push_back({ModbusResult::ok, {1, 3, 6, 0, 1, 0, 0, 0, 0}});
    drive.exchange(line, k * 8 * ms, 5 * ms);
  }
  drive.on_sync(800 * ms);
  EXPECT_NEAR(drive.achieved_rate_Hz(), 125.0, 1e-6);
}

// ---- mistakes -------------------------------------------------------------------------------------------------------

std::string refusal_of(const description::ModbusLineDescription& line,
                       ModbusPeers peers = ModbusPeers::on_this_machine) {
  try {
    (void)open_modbus(line, 0.02, peers);
  } catch (const description::SetupError& error) {
    return error.what();
  }
  return "";
}

TEST(ModbusPeer, IsOnThisMachineOnlyByLoopbackAddressOrPseudoTerminal) {
  description::ModbusLineDescription line;
  for (const char* const host : {"127.0.0.1", "127.255.0.3"}) {
    line.host = host;
    EXPECT_TRUE(is_on_this_machine(line)) << host;
  }
  // An address of this machine's in a network, names that only look like a loopback address, octal and short forms.
  for (const char* const host : {"192.168.0.10", "10.0.0.127", "0.0.0.0", "127.0.0.1.example.org", "127.1",
                                 "0127.0.0.1", "localhost", "::1", "128.0.0.1", "255.255.255.255"}) {
    line.host = host;
    EXPECT_FALSE(is_on_this_machine(line)) << host;
  }
  line.host.clear();
  for (const char* const device : {"/dev/ttyUSB0", "/dev/ttyS0", "/dev/serial/by-id/usb-x", "/dev/pts/../ttyS0", ""}) {
    line.device = device;
    EXPECT_FALSE(is_on_this_machine(line)) << device;
  }
  line.device = "/dev/pts/0";
  EXPECT_TRUE(is_on_this_machine(line));
}

// A link is what it leads to.
TEST(ModbusPeer, LinkToARealPortIsReal) {
  const ScratchFolder folder;
  description::ModbusLineDescription line;
  line.device = folder.path() / "arm";
  std::filesystem::create_symlink("/dev/ttyS0", line.device);
  EXPECT_FALSE(is_on_this_machine(line));
  std::filesystem::remove(line.device);
  std::filesystem::create_symlink("/dev/pts/ptmx", line.device);
  EXPECT_TRUE(is_on_this_machine(line));
}

TEST(ModbusRefuses, PeersOutsideThisMachineUnlessTheyAreAllowed) {
  description::ModbusLineDescription line;
  line.host = "192.0.2.1";  // RFC 5737: nobody's
  EXPECT_THAT(refusal_of(line), HasSubstr("found 192.0.2.1, expected a loopback address"));
  line.host.clear();
  line.device = "/dev/ttyUSB_none";
  EXPECT_THAT(refusal_of(line), HasSubstr("found /dev/ttyUSB_none, expected a pseudo-terminal"));
  EXPECT_THAT(refusal_of(line, ModbusPeers::any),
              AllOf(HasSubstr("the Modbus line can't be opened"), HasSubstr("/dev/ttyUSB_none: No such file")));
}

TEST(ModbusRefuses, DescriptionsThatCannotBe) {
  const auto message = [](const std::string& text) -> std::string {
    try {
      (void)description::read_modbus_drive(description::YamlNode::parse(text, "drive.yaml"));
    } catch (const description::SetupError& error) {
      return error.what();
    }
    return "";
  };
  const std::string good =
      "name: x\nprotocol: modbus\ncommand: {register: 0, values: [{signal: position}]}\ncontrol: {on: 0, off: 0}\n"
      "feedback: {register: 16, count: 3, position: {register: 17}, status: {register: 16, registers: 1}}\n";
  EXPECT_EQ(message(good), "");
  EXPECT_THAT(message(good + "stale_after_s: 0.001\n"), HasSubstr("at least two periods of rate_Hz"));
  EXPECT_THAT(message("name: x\nprotocol: modbus\ncommand: {register: 0, values: [{value: 1}]}\n"),
              HasSubstr("exactly one value with signal: position"));
  std::string outside = good;
  outside.replace(outside.find("register: 17"), 12, "register: 18");
  EXPECT_THAT(message(outside), HasSubstr("registers among those that are read, 16 to 18"));
}

// A map whose blocks overlapped was taken, and moved the arm when it was enabled: the speed went into the register of
// the target. So was one whose status could never be seen.
TEST(ModbusRefuses, RegisterMapsThatContradictThemselves) {
  const std::string good = R"(name: x
protocol: modbus
command:
  register: 0
  values:
    - {signal: control, registers: 1}
    - {signal: position}
    - {signal: speed, value: 1}
control: {on: 1, off: 0}
feedback:
  register: 16
  count: 3
  position: {register: 17}
  status: {register: 16, registers: 1, ready_mask: 0x1, enabled_mask: 0x2, fault_mask: 0x8}
settings:
  - {name: timeout, register: 32, registers: 1, value: 60}
  - {name: ramp, register: 33, value: 1000}
)";
  const auto told = [&](const std::string& from, const std::string& to) -> std::string {
    std::string text = good;
    EXPECT_NE(text.find(from), std::string::npos) << from;
    text.replace(text.find(from), from.size(), to);
    try {
      (void)description::read_modbus_drive(description::YamlNode::parse(text, "drive.yaml"));
    } catch (const description::SetupError& error) {
      return error.what();
    }
    return "taken";
  };
  EXPECT_EQ(told("name: x", "name: y"), "taken");
  EXPECT_THAT(told("register: 33", "register: 32"),
              HasSubstr("drive.yaml:17: settings[1].register: found setting \"ramp\" "
                        "in 32 to 33, which overlap those of setting"));
  EXPECT_THAT(told("register: 33", "register: 4"), HasSubstr("overlap those of the command, 0 to 4"));
  EXPECT_THAT(told("register: 33", "register: 15"), HasSubstr("overlap those of the status"));
  EXPECT_THAT(told("position: {register: 17}", "position: {register: 16}"), HasSubstr("overlap those of the position"));
  EXPECT_THAT(told("  register: 0", "  register: 14"), HasSubstr("drive.yaml:13: feedback.position.register"));
  EXPECT_THAT(told("enabled_mask: 0x2", "enabled_mask: 0x2, enabled_value: 0x4"), HasSubstr("never be seen"));
  EXPECT_THAT(told("ready_mask: 0x1", "ready_mask: 0x10001"), HasSubstr("feedback.status.ready_mask"));
  EXPECT_THAT(told("fault_mask: 0x8", "fault_mask: 0xA"), HasSubstr("clear while the drive is ready"));
  EXPECT_THAT(told(", enabled_mask: 0x2", ""), HasSubstr("the motor is driven"));
  EXPECT_THAT(told("on: 1", "on: 0"), HasSubstr("a control word other than `off`"));
  EXPECT_THAT(told("on: 1", "on: 70000"), HasSubstr("control.on: found 70000"));
  EXPECT_THAT(told("{signal: speed, value: 1}", "{signal: control}"), HasSubstr("at most one value with signal"));
  EXPECT_THAT(told("{signal: speed, value: 1}", "{signal: speed, value: -1}"), HasSubstr("from 0 to 4294967295"));
  EXPECT_THAT(told("{signal: position}", "{signal: position, value: 3}"), HasSubstr("no value for signal: position"));
  EXPECT_THAT(told("{signal: control, registers: 1}", "{value: 1, registers: 1}"), HasSubstr("the same as `off`"));
}

}  // namespace
}  // namespace proxarm::fieldbus
