// A Modbus master on one line: sends a request and waits for its answer.
//
// Uses libmodbus, over a TCP connection or a serial line in RTU mode. Each call blocks for at most the response timeout
// and, over TCP after a failure, as long again for a new connection. For one thread.
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
  [[nodiscard]] int exception() const noexcept { return exception_; }  // code of the last result `exception`

 protected:
  // Sends unit and PDU and receives those of the answer. Returns ok as soon as an answer is complete.
  virtual ModbusResult transact(const ModbusMessage& request, ModbusMessage& answer) noexcept = 0;

 private:
  ModbusResult exchange(const ModbusMessage& request, std::span<std::uint16_t> values) noexcept;

  int exception_ = 0;
};

// True if the peer is a process of this machine (loopback address or pseudo-terminal), so that no real axis can move. A
// tunnel from such a peer to a real drive can't be detected.
[[nodiscard]] bool is_on_this_machine(const description::ModbusLineDescription& line);

// "10.0.0.5, port 502" or "/dev/ttyUSB0".
[[nodiscard]] std::string peer_text(const description::ModbusLineDescription& line);

enum class ModbusPeers {
  on_this_machine,
  any,  // the user has confirmed that real axes may move
};

// Opens the line. Throws SetupError if nothing answers, the device doesn't exist or the peer isn't allowed.
[[nodiscard]] std::unique_ptr<ModbusClient> open_modbus(const description::ModbusLineDescription& line,
                                                        double response_timeout_s,
                                                        ModbusPeers peers = ModbusPeers::on_this_machine);

}  // namespace proxarm::fieldbus
