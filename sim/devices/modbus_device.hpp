// A simulated drive on a Modbus line. It has the holding registers of its description, and an axis that moves to the
// position of the last command at the speed of that command.
//
// A server's thread may call serve() at any time. The thread of the physics calls on_time() at least once a
// millisecond. The axis is driven while the control word requests it; a drive without a control word is always driven.
// The setting "communication timeout" (ms; 0: not watched) says how long a request may be missing; after that the drive
// stops until it is switched off and on again.
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

// Faults of the drive's answers. VALUE is that of device_fault.hpp.
enum class ModbusFault : std::uint8_t {
  none,
  exception,
  silent,
  lost,  // one of VALUE requests gets no answer
  late,  // the answer comes VALUE ms late; only on a real line
  closed,
  wrong_unit,      // the answer has the number of the next unit
  wrong_function,  // the answer has another function code
  wrong_count,     // the answer announces one register less
  half,            // the answer is cut in half
  low_word_first,  // the words are in the opposite order of the file's
  forgets,         // the drive acknowledges settings without storing them
  no_function_23,  // function 23 is answered by exception 01
  not_ready,       // the status never shows ready or driven
  not_driven,      // the status never shows driven
  tripped,         // the status shows a fault
  echo,            // RTU: the adapter echoes each request before the answer
};

// A device that answers on a Modbus line.
class ModbusUnit {
 public:
  ModbusUnit() = default;
  ModbusUnit(const ModbusUnit&) = delete;
  ModbusUnit& operator=(const ModbusUnit&) = delete;
  virtual ~ModbusUnit() = default;

  [[nodiscard]] virtual std::uint8_t unit() const noexcept = 0;
  // Takes a request to this unit (unit and PDU). Returns the answer (unit and PDU); empty: the device doesn't answer.
  [[nodiscard]] virtual std::vector<std::uint8_t> serve(std::span<const std::uint8_t> request) = 0;
  [[nodiscard]] virtual ModbusFault fault() const noexcept = 0;
  [[nodiscard]] virtual int late_ms() const noexcept { return 0; }
};

class ModbusDevice final : public ModbusUnit {
 public:
  ModbusDevice(const description::ModbusDriveDescription& registers, std::uint8_t unit,
               double deceleration_counts_per_s2, ServoAxis& axis);

  [[nodiscard]] std::uint8_t unit() const noexcept override { return unit_; }
  // Supports functions 3, 16 and 23. Other functions are answered by exception 01.
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
  std::unordered_map<unsigned, std::uint16_t> bank_;  // the registers that exist
  ModbusFault fault_ = ModbusFault::none;
  std::uint32_t fault_value_ = 0, requests_ = 0;
  bool commanded_ = false, requested_ = false, enabled_ = false, timed_out_ = false;
  std::int64_t last_request_ns_ = 0;
};

}  // namespace proxarm::sim
