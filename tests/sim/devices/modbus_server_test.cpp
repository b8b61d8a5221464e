// Master and simulated drive over a real TCP connection of the loopback interface and over a pseudo-terminal: libmodbus
// on one side, hand-written framing on the other. Nothing here judges how long anything takes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <thread>

#include "fieldbus/modbus/modbus_client.hpp"
#include "fieldbus/modbus/modbus_line.hpp"
#include "models/base/setup_error.hpp"
#include "sim/devices/modbus_server.hpp"
#include "tests/source_file.hpp"

namespace proxarm::sim {
namespace {

using fieldbus::ModbusResult;
using ::testing::ElementsAre;

// Far above what an answer takes on a loaded machine.
constexpr double patience_s = 1.0;
constexpr double impatience_s = 0.05;  // where no answer is to come

description::ModbusLineDescription loopback(int port) {
  description::ModbusLineDescription line;
  line.host = "127.0.0.1";
  line.port = port;
  return line;
}

class StillAxis final : public ServoAxis {
 public:
  void enable(std::int64_t) noexcept override { enabled = true; }
  void disable() noexcept override { enabled = false; }
  void set_interpolation_period_ns(std::int64_t period_ns) noexcept override { takes_ns = period_ns; }
  void set_target(std::int32_t counts, std::int64_t) noexcept override { target = counts; }
  void set_torque(double) noexcept override {}
  void stop(double, std::int64_t) noexcept override { stopped = true; }
  [[nodiscard]] std::int32_t position_counts() const noexcept override { return position; }
  [[nodiscard]] std::int32_t demand_counts() const noexcept override { return position; }
  [[nodiscard]] double speed_counts_per_s() const noexcept override { return 0.0; }
  [[nodiscard]] double torque_ratio() const noexcept override { return 0.0; }
  [[nodiscard]] bool limited() const noexcept override { return false; }
  [[nodiscard]] bool at_rest() const noexcept override { return true; }

  bool enabled = false, stopped = false;
  std::int32_t position = -70000, target = 0;
  std::int64_t takes_ns = 0;
};

class ModbusLines : public ::testing::TestWithParam<bool> {
 protected:
  ModbusLines() { device.on_time(0); }

  description::ModbusLineDescription served() const {
    if (!GetParam()) return loopback(0);
    description::ModbusLineDescription line;
    line.parity = "none";  // a pseudo-terminal has none
    return line;
  }
  std::unique_ptr<fieldbus::ModbusClient> client(double timeout_s, bool echo = false) const {
    description::ModbusLineDescription line = served();
    line.echo = echo;
    line.port = server.port();
    line.device = server.device();
    return fieldbus::open_modbus(line, timeout_s);
  }

  StillAxis axis;
  ModbusDevice device{description::load_modbus_drive(source_file("models/drives/generic_absolute.yaml")), 1, 1e6, axis};
  ModbusServer server{served(), {&device}};
};

TEST_P(ModbusLines, CarryReadWriteAndBothAtOnce) {
  const auto master = client(patience_s);
  std::array<std::uint16_t, 3> read{};
  ASSERT_EQ(master->read(1, 16, read), ModbusResult::ok);
  EXPECT_THAT(read, ElementsAre(1, 0xFFFE, 0xEE90));  // ready; −70000
  const std::array<std::uint16_t, 1> timeout{60};
  ASSERT_EQ(master->write(1, 32, timeout), ModbusResult::ok);
  EXPECT_EQ(device.register_at(32), 60);
  // On, to −69000 at 100000 counts/s: 10 ms.
  const std::array<std::uint16_t, 5> command{1, 0xFFFE, 0xF278, 0x0001, 0x86A0};
  ASSERT_EQ(master->read_write(1, 16, read, 0, command), ModbusResult::ok);
  device.on_time(1'000'000);
  EXPECT_TRUE(axis.enabled);
  EXPECT_EQ(axis.target, -69000);
  EXPECT_EQ(axis.takes_ns, 10'000'000);
}

TEST_P(ModbusLines, TellExceptionsApart) {
  const auto master = client(patience_s);
  std::array<std::uint16_t, 3> read{};
  EXPECT_EQ(master->read(1, 1000, read), ModbusResult::exception);
  EXPECT_EQ(master->exception(), 2);  // illegal data address
  device.set_fault(ModbusFault::exception, 4);
  EXPECT_EQ(master->read(1, 16, read), ModbusResult::exception);
  EXPECT_EQ(master->exception(), 4);  // server device failure
  device.set_fault(ModbusFault::none);
  EXPECT_EQ(master->read(1, 16, read), ModbusResult::ok);
}

TEST_P(ModbusLines, RecoverFromSilenceAndHalfAnAnswer) {
  const auto master = client(impatience_s);
  std::array<std::uint16_t, 3> read{};
  for (const ModbusFault fault : {ModbusFault::silent, ModbusFault::half}) {
    device.set_fault(fault);
    EXPECT_EQ(master->read(1, 16, read), ModbusResult::timeout);
    device.set_fault(ModbusFault::none);
    const auto again = client(patience_s);
    EXPECT_EQ(again->read(1, 16, read), ModbusResult::ok);
  }
}

TEST_P(ModbusLines, NameAnotherUnitsAnswer) {
  const auto master = client(patience_s);
  std::array<std::uint16_t, 3> read{};
  device.set_fault(ModbusFault::wrong_unit);
  EXPECT_EQ(master->read(1, 16, read), ModbusResult::wrong_unit);
}

struct BadAnswer {
  const char* name;
  ModbusFault fault;
  std::uint32_t value;
  ModbusResult expected;
};
// By the specification, V1.1b3: the function is repeated (4.2), a read's byte count is twice its registers (6.3). An
// answer that comes after the response timeout is none.
constexpr BadAnswer bad_answers[] = {
    {"another function", ModbusFault::wrong_function, 0, ModbusResult::malformed},
    {"a register less than asked for", ModbusFault::wrong_count, 0, ModbusResult::malformed},
    {"another unit", ModbusFault::wrong_unit, 0, ModbusResult::wrong_unit},
    {"half", ModbusFault::half, 0, ModbusResult::timeout},
    {"none", ModbusFault::silent, 0, ModbusResult::timeout},
    {"one that is late", ModbusFault::late, 150, ModbusResult::timeout},
    {"one request of one lost", ModbusFault::lost, 1, ModbusResult::timeout},
    {"gateway path unavailable", ModbusFault::exception, 10, ModbusResult::exception},
};

TEST_P(ModbusLines, JudgeAnswersAsTheSpecificationDoes) {
  for (const BadAnswer& bad : bad_answers) {
    SCOPED_TRACE(bad.name);
    const auto master = client(impatience_s);
    std::array<std::uint16_t, 3> read{};
    device.set_fault(bad.fault, bad.value);
    const ModbusResult result = master->read(1, 16, read);
    device.set_fault(ModbusFault::none);
    // A register more or less shifts what a serial line takes for the checksum, so the answer has no end there.
    const bool has_no_end =
        GetParam() && (bad.fault == ModbusFault::wrong_count || bad.fault == ModbusFault::wrong_function);
    if (has_no_end) {
      EXPECT_NE(result, ModbusResult::ok);
    } else {
      EXPECT_EQ(result, bad.expected);
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(200));  // what is late comes now
  }
}

TEST_P(ModbusLines, NeverTakeALateAnswerForThatOfAnotherRequest) {
  const auto master = client(impatience_s);
  std::array<std::uint16_t, 3> position{};
  std::array<std::uint16_t, 1> timeout{60};
  ASSERT_EQ(master->write(1, 32, timeout), ModbusResult::ok);
  device.set_fault(ModbusFault::late, 80);
  EXPECT_EQ(master->read(1, 16, position), ModbusResult::timeout);
  device.set_fault(ModbusFault::none);
  // Asked on and on while the late answer comes in.
  int answered = 0;
  for (int i = 0; i < 20; ++i) {
    timeout[0] = 0;
    if (master->read(1, 32, timeout) != ModbusResult::ok) continue;
    ++answered;
    EXPECT_EQ(timeout[0], 60);
  }
  EXPECT_GT(answered, 0) << "it recovers";
}

TEST_P(ModbusLines, SwallowTheEchoOfAnAdapterThatHearsItself) {
  if (!GetParam()) return;  // TCP has none
  device.set_fault(ModbusFault::echo);
  std::array<std::uint16_t, 3> read{};
  const std::array<std::uint16_t, 1> timeout{60};
  const auto told = client(patience_s, true);
  EXPECT_EQ(told->read(1, 16, read), ModbusResult::ok);
  EXPECT_EQ(told->write(1, 32, timeout), ModbusResult::ok);
  EXPECT_EQ(told->read(1, 16, read), ModbusResult::ok);
  EXPECT_THAT(read, ElementsAre(1, 0xFFFE, 0xEE90));
  const auto untold = client(impatience_s);
  EXPECT_NE(untold->read(1, 16, read), ModbusResult::ok);
  device.set_fault(ModbusFault::none);
  const auto wrongly_told = client(impatience_s, true);
  EXPECT_NE(wrongly_told->read(1, 16, read), ModbusResult::ok);
}

INSTANTIATE_TEST_SUITE_P(Wires, ModbusLines, ::testing::Bool(),
                         [](const auto& wire) { return wire.param ? "Rtu" : "Tcp"; });

TEST(ModbusConnection, ThatIsClosedIsNoticed) {
  StillAxis axis;
  ModbusDevice device{description::load_modbus_drive(source_file("models/drives/generic_absolute.yaml")), 1, 1e6, axis};
  device.on_time(0);
  ModbusServer server(loopback(0), {&device});
  const auto master = fieldbus::open_modbus(loopback(server.port()), patience_s);
  std::array<std::uint16_t, 3> read{};
  ASSERT_EQ(master->read(1, 16, read), ModbusResult::ok);
  device.set_fault(ModbusFault::closed);
  EXPECT_EQ(master->read(1, 16, read), ModbusResult::closed);
}

TEST(ModbusConnection, ToNobodyIsRefused) {
  int port = 0;
  {
    StillAxis axis;
    ModbusServer server(loopback(0), {});
    port = server.port();
  }
  try {
    (void)fieldbus::open_modbus(loopback(port), patience_s);
    FAIL();
  } catch (const description::SetupError& error) {
    EXPECT_THAT(error.what(), ::testing::HasSubstr("the Modbus line can't be opened"));
  }
}

// The whole of a real line: worker thread, TCP, server thread; here the cycle and the physics share this thread.
TEST(ModbusThread, MovesADriveWhileTheCycleNeverWaits) {
  StillAxis axis;
  const auto registers = description::load_modbus_drive(source_file("models/drives/generic_absolute.yaml"));
  ModbusDevice device{registers, 1, 1e6, axis};
  axis.position = 500;
  device.on_time(0);
  ModbusServer server(loopback(0), {&device});
  description::DriveDescription joint;
  joint.node = 1;
  joint.profile = "modbus";
  joint.counts_per_motor_revolution = 2.0 * M_PI * 1000.0;
  joint.gear_ratio = 1.0;
  joint.range_rad = {-10.0, 10.0};
  description::ModbusDriveDescription patient = registers;
  patient.stale_after_s = 2.0;  // a loaded machine
  fieldbus::ModbusDrive drive(joint, patient, 1'000'000);
  fieldbus::ModbusLine line(loopback(server.port()), fieldbus::open_modbus(loopback(server.port()), patience_s),
                            {&drive});
  const auto now_ns = [] {
    return std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::steady_clock::now().time_since_epoch())
        .count();
  };
  line.start_up(now_ns());
  line.start();
  drive.request(fieldbus::DriveGoal::operation_enabled);
  double target = 0.5;
  for (int cycle = 0; cycle < 20'000 && axis.target != 600; ++cycle) {
    drive.on_sync(now_ns());
    if (drive.set_target_rad(target)) target = std::min(0.6, target + 1e-4);
    device.on_time(now_ns());
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  EXPECT_TRUE(drive.following()) << drive.describe();
  EXPECT_EQ(axis.target, 600);
  EXPECT_EQ(drive.fault(), fieldbus::DriveFault::none) << drive.describe();
  EXPECT_GT(drive.achieved_rate_Hz(), 0.0);
  line.stop();
}

TEST(ModbusDrive, StopsByItselfWithoutRequests) {
  StillAxis axis;
  ModbusDevice device{description::load_modbus_drive(source_file("models/drives/generic_absolute.yaml")), 1, 1e6, axis};
  using Bytes = std::vector<std::uint8_t>;
  EXPECT_THAT(device.serve(Bytes{1, 16, 0, 32, 0, 1, 2, 0, 60}), ElementsAre(1, 16, 0, 32, 0, 1));
  EXPECT_THAT(device.serve(Bytes{1, 16, 0, 0, 0, 5, 10, 0, 1, 0, 0, 0, 5, 0, 0, 0, 1}), ElementsAre(1, 16, 0, 0, 0, 5));
  device.on_time(1'000'000);
  EXPECT_TRUE(axis.enabled);
  device.on_time(61'000'000);
  EXPECT_FALSE(device.timed_out());
  device.on_time(62'000'000);
  EXPECT_TRUE(device.timed_out());
  EXPECT_TRUE(axis.stopped);
  EXPECT_EQ(device.register_at(16), 1 | 8) << "ready, fault, not driven";
}

}  // namespace
}  // namespace proxarm::sim
