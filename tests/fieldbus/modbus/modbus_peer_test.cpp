// Our master against python3-pymodbus, which shares nothing with it: Modbus TCP on the loopback interface, RTU over
// pseudo-terminals. modbus_peer.py is the drive.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <string>

#include "fieldbus/modbus/modbus_client.hpp"
#include "tests/source_file.hpp"

namespace proxarm::fieldbus {
namespace {

using ::testing::ElementsAre;

// Ends when its standard input does.
class Peer {
 public:
  explicit Peer(const char* wire) {
    std::array<int, 2> in{}, out{};
    if (pipe(in.data()) != 0 || pipe(out.data()) != 0) return;
    process_ = fork();
    if (process_ == 0) {
      dup2(in[0], 0);
      dup2(out[1], 1);
      for (const int fd : {in[0], in[1], out[0], out[1]}) close(fd);
      execl("/usr/bin/python3", "python3", source_file("tests/fieldbus/modbus/modbus_peer.py").c_str(), wire, nullptr);
      _exit(127);
    }
    close(in[0]);
    close(out[1]);
    keep_ = in[1];
    char c = 0;
    while (read(out[0], &c, 1) == 1 && c != '\n') place += c;
    close(out[0]);
  }
  Peer(const Peer&) = delete;
  Peer& operator=(const Peer&) = delete;
  ~Peer() {
    close(keep_);
    waitpid(process_, nullptr, 0);
  }

  std::string place;  // port or device

 private:
  int keep_ = -1;
  pid_t process_ = -1;
};

class ModbusPeer : public ::testing::TestWithParam<const char*> {};

TEST_P(ModbusPeer, OfPymodbusIsReadAndWritten) {
  const Peer peer(GetParam());
  ASSERT_FALSE(peer.place.empty()) << "python3-pymodbus and python3-serial-asyncio are needed";
  description::ModbusLineDescription line;
  line.parity = "none";
  if (GetParam() == std::string("tcp")) {
    line.host = "127.0.0.1";
    line.port = std::atoi(peer.place.c_str());
  } else {
    line.device = peer.place;
  }
  const auto master = open_modbus(line, 5.0);  // of patience: Python on a loaded machine
  std::array<std::uint16_t, 3> values{};
  ASSERT_EQ(master->read(1, 16, values), ModbusResult::ok);
  EXPECT_THAT(values, ElementsAre(1016, 1017, 1018));
  const std::array<std::uint16_t, 2> written{0xFFFE, 0xEE90};
  ASSERT_EQ(master->write(1, 17, written), ModbusResult::ok);
  const std::array<std::uint16_t, 5> command{1, 0, 500, 0, 2000};
  ASSERT_EQ(master->read_write(1, 16, values, 0, command), ModbusResult::ok);
  EXPECT_THAT(values, ElementsAre(1016, 0xFFFE, 0xEE90));
  std::array<std::uint16_t, 5> back{};
  ASSERT_EQ(master->read(1, 0, back), ModbusResult::ok);
  EXPECT_EQ(back, command);
  EXPECT_EQ(master->read(1, 99, values), ModbusResult::exception);
  EXPECT_EQ(master->exception(), 2);  // illegal data address
}

INSTANTIATE_TEST_SUITE_P(Wires, ModbusPeer, ::testing::Values("tcp", "rtu"),
                         [](const auto& wire) { return std::string(wire.param); });

}  // namespace
}  // namespace proxarm::fieldbus
