// A simulated drive on a Modbus line: holding registers as its description lays them out, and an axis that goes where
// the last command sent it, at the speed that came with it.
//
// serve() may be called by a server's thread at any time; on_time() by the physics' own, at least once a millisecond.
// The axis is driven while the control word says so, or, of a drive without one, always. Without a request for the
// setting "communication timeout" (milliseconds; 0: not supervised) it stops by itself and stays stopped until it is
// switched off and on again.
#pragma once

#include <cstdint>
#include <functional>
#include <mutex>
#include <span>
#include <unordered_map>
#include <vector>

#include "models/description/modbus_drive.hpp"
#include "sim/devices/servo_axis.hpp"

namespace proxarm::sim {

// Exception codes of a Modbus server.
inline constexpr std::uint8_t illegal_function = 1, illegal_address = 2, illegal_value = 3;

// What may be wrong with its answers.
enum class ModbusFault : std::uint8_t {
  none,
  exception,       // VALUE, such as 04, server device failure
  silent,          // no answer
  lost,            // one of VALUE requests has no answer
  late,            // the answer comes VALUE milliseconds later; on a real line only
  closed,          // the connection is closed
  wrong_unit,      // the answer bears the next unit's number
  wrong_function,  // the answer bears another function's
  wrong_count,     // the answer says that it has a register less than it has
  half,            // the answer ends in its middle
  low_word_first,  // values in two registers have their words in the other order than the file says
  forgets,         // settings are acknowledged and not kept
  no_function_23,  // that function is answered by exception 01
  not_ready,       // the status never says that it is ready, nor that it is driven
  not_driven,      // the status never says that it is driven
  tripped,         // the status says that it has a fault
  echo,            // RTU: its adapter echoes each request before the answer
};

// What answers on a Modbus line.
class ModbusUnit {
 public:
  ModbusUnit() = default;
  ModbusUnit(const ModbusUnit&) = delete;
  ModbusUnit& operator=(const ModbusUnit&) = delete;
  virtual ~ModbusUnit() = default;

  [[nodiscard]] virtual std::uint8_t unit() const noexcept = 0;
  // Unit and PDU of a request to this unit; the answer's, empty where there is none.
  [[nodiscard]] virtual std::vector<std::uint8_t> serve(std::span<const std::uint8_t> request) = 0;
  [[nodiscard]] virtual ModbusFault fault() const noexcept = 0;
  [[nodiscard]] virtual int late_ms() const noexcept { return 0; }
};

class ModbusDevice final : public ModbusUnit {
 public:
  ModbusDevice(const description::ModbusDriveDescription& registers, std::uint8_t unit,
               double deceleration_counts_per_s2, ServoAxis& axis);

  [[nodiscard]] std::uint8_t unit() const noexcept override { return unit_; }
  // Functions 3, 16 and 23, else exception 01.
  [[nodiscard]] std::vector<std::uint8_t> serve(std::span<const std::uint8_t> request) override;
  void on_time(std::int64_t time_ns) noexcept;

  void set_fault(ModbusFault fault, std::uint32_t value = 0) noexcept;
  [[nodiscard]] ModbusFault fault() const noexcept override;
  [[nodiscard]] int late_ms() const noexcept override;
  [[nodiscard]] std::uint16_t register_at(std::uint16_t at) const;
  [[nodiscard]] bool timed_out() const noexcept;

 private:
  [[nodiscard]] bool high_word_first() const noexcept {
    return registers_.high_word_first != (fault_ == ModbusFault::low_word_first);
  }
  [[nodiscard]] bool is_forgotten(unsigned at) const noexcept;
  [[nodiscard]] std::vector<std::uint8_t> answer_to(std::span<const std::uint8_t> request);
  [[nodiscard]] bool read_into(std::vector<std::uint8_t>& answer, unsigned at, unsigned count) const;
  [[nodiscard]] bool store(unsigned at, unsigned count, std::span<const std::uint8_t> bytes);
  void note_command(unsigned at, unsigned count) noexcept;
  [[nodiscard]] std::int64_t value_at(unsigned at, int registers) const noexcept;
  void put(unsigned at, int registers, std::int64_t value) noexcept;
  void obey(std::int64_t time_ns) noexcept;
  void supervise(std::int64_t time_ns) noexcept;
  void publish() noexcept;

  description::ModbusDriveDescription registers_;
  std::uint8_t unit_;
  double deceleration_;
  ServoAxis& axis_;
  mutable std::mutex mutex_;
  std::unordered_map<unsigned, std::uint16_t> bank_;  // the registers that there are
  ModbusFault fault_ = ModbusFault::none;
  std::uint32_t fault_value_ = 0, requests_ = 0;
  bool commanded_ = false, requested_ = false, enabled_ = false, timed_out_ = false;
  std::int64_t last_request_ns_ = 0;
};

}  // namespace proxarm::sim
