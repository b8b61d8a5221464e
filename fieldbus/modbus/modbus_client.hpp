// A Modbus master on one line: sends a request and waits for its answer.
//
// It uses libmodbus, over a TCP connection or a serial line in RTU mode. Each call blocks for at most the response
// timeout. Over TCP, the call after a failure first makes a new connection, which takes at most another response
// timeout. Only one thread may use a client.
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
  // Exception code of the last call that returned ModbusResult::exception.
  [[nodiscard]] int exception() const noexcept { return exception_; }

 protected:
  // Sends the request (unit and PDU) and receives the answer (unit and PDU). Returns ok as soon as the answer is
  // complete.
  virtual ModbusResult transact(const ModbusMessage& request, ModbusMessage& answer) noexcept = 0;

 private:
  ModbusResult exchange(const ModbusMessage& request, std::span<std::uint16_t> values) noexcept;

  int exception_ = 0;
};

// True if the peer is a process of this machine (loopback address or pseudo-terminal), so that no real axis can move.
// If that process forwards the line to a real drive, this can't be detected.
[[nodiscard]] bool is_on_this_machine(const description::ModbusLineDescription& line);

// Returns the peer's address, such as "10.0.0.5, port 502" or "/dev/ttyUSB0".
[[nodiscard]] std::string peer_text(const description::ModbusLineDescription& line);

enum class ModbusPeers {
  on_this_machine,
  any,  // the user has confirmed that real axes may move
};

// Opens the line. Throws SetupError if no peer answers, if the serial device doesn't exist, or if `peers` doesn't allow
// the peer.
[[nodiscard]] std::unique_ptr<ModbusClient> open_modbus(const description::ModbusLineDescription& line,
                                                        double response_timeout_s,
                                                        ModbusPeers peers = ModbusPeers::on_this_machine);

}  // namespace proxarm::fieldbus
