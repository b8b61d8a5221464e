// A Modbus master on one line: a request goes out, its answer comes back or doesn't.
//
// Through libmodbus: a TCP connection or a serial line in RTU mode. Blocks for at most the response timeout (and, over
// TCP after a failure, once more for a new connection); one thread uses it.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "fieldbus/modbus/modbus_pdu.hpp"
#include "models/description/cell.hpp"

namespace proxarm::fieldbus {

class ModbusClient {
 public:
  ModbusClient() = default;
  ModbusClient(const ModbusClient&) = delete;
  ModbusClient& operator=(const ModbusClient&) = delete;
  virtual ~ModbusClient() = default;

  ModbusResult read(std::uint8_t unit, std::uint16_t at, std::span<std::uint16_t> values) noexcept;
  ModbusResult write(std::uint8_t unit, std::uint16_t at, std::span<const std::uint16_t> values) noexcept;
  ModbusResult read_write(std::uint8_t unit, std::uint16_t read_at, std::span<std::uint16_t> read_values,
                          std::uint16_t at, std::span<const std::uint16_t> values) noexcept;
  [[nodiscard]] int exception() const noexcept { return exception_; }  // of the last result that was one

 protected:
  // Sends unit and PDU, takes the answer's. The result is ok as soon as an answer is complete.
  virtual ModbusResult transact(const ModbusMessage& request, ModbusMessage& answer) noexcept = 0;

 private:
  ModbusResult exchange(const ModbusMessage& request, std::span<std::uint16_t> values) noexcept;

  int exception_ = 0;
};

// Is the peer a process of this very machine, so that nothing real can move: a loopback address, a pseudo-terminal? A
// tunnel from one of those to a real drive can't be seen.
[[nodiscard]] bool is_on_this_machine(const description::ModbusLineDescription& line);

// "10.0.0.5, port 502" or "/dev/ttyUSB0".
[[nodiscard]] std::string peer_text(const description::ModbusLineDescription& line);

enum class ModbusPeers {
  on_this_machine,
  any,  // somebody has said that real axes may move
};

// Opens the line. Throws SetupError: nobody there, no such device, or a peer that isn't allowed.
[[nodiscard]] std::unique_ptr<ModbusClient> open_modbus(const description::ModbusLineDescription& line,
                                                        double response_timeout_s,
                                                        ModbusPeers peers = ModbusPeers::on_this_machine);

}  // namespace proxarm::fieldbus
