#include "sim/devices/modbus_device.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace proxarm::sim {
namespace {

using description::ModbusValue;

unsigned word(std::span<const std::uint8_t> bytes, std::size_t at) noexcept {
  return static_cast<unsigned>(bytes[at] << 8 | bytes[at + 1]);
}

std::vector<std::uint8_t> exception(std::span<const std::uint8_t> request, std::uint8_t code) {
  return {request[0], static_cast<std::uint8_t>(request[1] | 0x80U), code};
}

}  // namespace

ModbusDevice::ModbusDevice(const description::ModbusDriveDescription& registers, std::uint8_t unit,
                           double deceleration_counts_per_s2, ServoAxis& axis)
    : registers_(registers), unit_(unit), deceleration_(deceleration_counts_per_s2), axis_(axis) {
  const auto add = [this](unsigned at, int count) {
    for (int i = 0; i < count; ++i) bank_[at + static_cast<unsigned>(i)] = 0;
  };
  add(registers.command_register, registers.command_count());
  add(registers.feedback_register, registers.feedback_count);
  add(registers.status.at, registers.status.registers);
  for (const description::ModbusSetting& setting : registers.settings) add(setting.at, setting.registers);
}

void ModbusDevice::set_fault(ModbusFault fault, std::uint32_t value) noexcept {
  const std::lock_guard lock(mutex_);
  fault_ = fault;
  fault_value_ = value;
}

int ModbusDevice::late_ms() const noexcept {
  const std::lock_guard lock(mutex_);
  return fault_ == ModbusFault::late ? static_cast<int>(fault_value_) : 0;
}

ModbusFault ModbusDevice::fault() const noexcept {
  const std::lock_guard lock(mutex_);
  return fault_;
}

bool ModbusDevice::timed_out() const noexcept {
  const std::lock_guard lock(mutex_);
  return timed_out_;
}

std::uint16_t ModbusDevice::register_at(std::uint16_t at) const {
  const std::lock_guard lock(mutex_);
  return bank_.at(at);
}

// ---- requests -------------------------------------------------------------------------------------------------------

std::vector<std::uint8_t> ModbusDevice::serve(std::span<const std::uint8_t> request) {
  const std::lock_guard lock(mutex_);
  if (request.size() < 2) return {};
  if (fault_ == ModbusFault::silent || fault_ == ModbusFault::closed) return {};
  if (fault_ == ModbusFault::lost && fault_value_ > 0 && ++requests_ % fault_value_ == 0) return {};
  if (fault_ == ModbusFault::exception) return exception(request, static_cast<std::uint8_t>(fault_value_));
  std::vector<std::uint8_t> answer = answer_to(request);
  if (fault_ == ModbusFault::wrong_unit) ++answer[0];
  if (fault_ == ModbusFault::wrong_function) ++answer[1];
  if (fault_ == ModbusFault::wrong_count) answer[2] = static_cast<std::uint8_t>(answer[2] - 2);
  if (fault_ == ModbusFault::half) answer.resize(answer.size() / 2);
  return answer;
}

bool ModbusDevice::is_forgotten(unsigned at) const noexcept {
  return fault_ == ModbusFault::forgets &&
         std::any_of(registers_.settings.begin(), registers_.settings.end(), [at](const auto& setting) {
           return at >= setting.at && at < setting.at + static_cast<unsigned>(setting.registers);
         });
}

std::vector<std::uint8_t> ModbusDevice::answer_to(std::span<const std::uint8_t> request) {
  const unsigned function = request[1];
  const bool known = function == 3 || function == 16 || (function == 23 && fault_ != ModbusFault::no_function_23);
  if (!known) return exception(request, illegal_function);
  if (request.size() < 6) return exception(request, illegal_value);
  requested_ = true;
  const unsigned at = word(request, 2), count = word(request, 4);
  std::vector<std::uint8_t> answer{request[0], request[1]};
  if (function == 3) {
    if (count < 1 || count > 125) return exception(request, illegal_value);
    return read_into(answer, at, count) ? answer : exception(request, illegal_address);
  }
  // The rest of the request is the written part, which function 23 has after the read part.
  const std::size_t first = function == 16 ? 2 : 6;
  if (request.size() < first + 5) return exception(request, illegal_value);
  const unsigned write_at = word(request, first), write_count = word(request, first + 2);
  const auto values = request.subspan(first + 5);
  if (write_count < 1 || write_count > 123 || request[first + 4] != 2 * write_count ||
      values.size() != 2 * write_count) {
    return exception(request, illegal_value);
  }
  if (!store(write_at, write_count, values)) return exception(request, illegal_address);
  note_command(write_at, write_count);
  if (function == 16) {
    answer.insert(answer.end(), request.begin() + 2, request.begin() + 6);
    return answer;
  }
  if (count < 1 || count > 125) return exception(request, illegal_value);
  return read_into(answer, at, count) ? answer : exception(request, illegal_address);
}

bool ModbusDevice::read_into(std::vector<std::uint8_t>& answer, unsigned at, unsigned count) const {
  answer.push_back(static_cast<std::uint8_t>(2 * count));
  for (unsigned i = at; i < at + count; ++i) {
    const auto found = bank_.find(i);
    if (found == bank_.end()) return false;
    answer.push_back(static_cast<std::uint8_t>(found->second >> 8));
    answer.push_back(static_cast<std::uint8_t>(found->second));
  }
  return true;
}

bool ModbusDevice::store(unsigned at, unsigned count, std::span<const std::uint8_t> bytes) {
  for (unsigned i = at; i < at + count; ++i) {
    if (bank_.find(i) == bank_.end()) return false;
  }
  for (unsigned i = 0; i < count; ++i) {
    if (!is_forgotten(at + i)) bank_[at + i] = static_cast<std::uint16_t>(word(bytes, 2 * i));
  }
  return true;
}

// Notes a command when the last register of the command is written. If a drive starts a motion only by a trigger, its
// trigger is in that register.
void ModbusDevice::note_command(unsigned at, unsigned count) noexcept {
  const unsigned last = registers_.command_register + static_cast<unsigned>(registers_.command_count()) - 1;
  if (at <= last && at + count > last) commanded_ = true;
}

std::int64_t ModbusDevice::value_at(unsigned at, int registers) const noexcept {
  const auto get = [this](unsigned i) { return bank_.find(i)->second; };
  if (registers == 1) return static_cast<std::int16_t>(get(at));
  const unsigned high = high_word_first() ? get(at) : get(at + 1);
  const unsigned low = high_word_first() ? get(at + 1) : get(at);
  return static_cast<std::int32_t>(high << 16 | low);
}

void ModbusDevice::put(unsigned at, int registers, std::int64_t value) noexcept {
  const auto high = static_cast<std::uint16_t>(static_cast<std::uint64_t>(value) >> 16);
  const auto low = static_cast<std::uint16_t>(value);
  if (registers == 1) {
    bank_.find(at)->second = low;
    return;
  }
  bank_.find(at)->second = high_word_first() ? high : low;
  bank_.find(at + 1)->second = high_word_first() ? low : high;
}

// ---- the axis -------------------------------------------------------------------------------------------------------

void ModbusDevice::on_time(std::int64_t time_ns) noexcept {
  const std::lock_guard lock(mutex_);
  if (requested_) last_request_ns_ = time_ns;
  requested_ = false;
  if (commanded_) obey(time_ns);
  commanded_ = false;
  supervise(time_ns);
  publish();
}

void ModbusDevice::obey(std::int64_t time_ns) noexcept {
  using Signal = ModbusValue::Signal;
  unsigned at = registers_.command_register;
  std::int64_t control = registers_.control_on, position = 0, speed = 0;
  for (const ModbusValue& v : registers_.command) {
    const std::int64_t value = value_at(at, v.registers);
    if (v.signal == Signal::control) control = value;
    if (v.signal == Signal::position) position = std::llround(static_cast<double>(value) / v.scale);
    if (v.signal == Signal::speed) speed = std::llround(static_cast<double>(value) / v.scale);
    at += static_cast<unsigned>(v.registers);
  }
  if (control != registers_.control_on) {
    if (enabled_) axis_.disable();
    enabled_ = timed_out_ = false;
    return;
  }
  if (timed_out_) return;
  if (!enabled_) axis_.enable(time_ns);
  enabled_ = true;
  const double way = std::abs(static_cast<double>(position) - axis_.demand_counts());
  constexpr double shortest_ns = 1e6, longest_ns = 1e9;
  const double takes_ns = speed > 0 ? 1e9 * way / static_cast<double>(speed) : longest_ns;
  axis_.set_interpolation_period_ns(std::llround(std::clamp(takes_ns, shortest_ns, longest_ns)));
  axis_.set_target(static_cast<std::int32_t>(std::clamp<std::int64_t>(position, INT32_MIN, INT32_MAX)), time_ns);
}

void ModbusDevice::supervise(std::int64_t time_ns) noexcept {
  if (!enabled_ || timed_out_) return;
  for (const description::ModbusSetting& setting : registers_.settings) {
    if (setting.name != "communication timeout") continue;
    const std::int64_t timeout_ms = value_at(setting.at, setting.registers);
    if (timeout_ms <= 0 || time_ns - last_request_ns_ <= timeout_ms * 1'000'000) continue;
    timed_out_ = true;
    axis_.stop(deceleration_, time_ns);
  }
}

void ModbusDevice::publish() noexcept {
  put(registers_.position.at, registers_.position.registers, axis_.position_counts());
  const bool is_ready = fault_ != ModbusFault::not_ready, says_driven = is_ready && fault_ != ModbusFault::not_driven;
  std::uint32_t status = is_ready ? registers_.ready_value : 0;
  if (enabled_ && !timed_out_ && says_driven) status |= registers_.enabled_value;
  if (timed_out_ || fault_ == ModbusFault::tripped) status |= registers_.fault_mask;
  put(registers_.status.at, registers_.status.registers, status);
}

}  // namespace proxarm::sim
