#include "fieldbus/modbus/modbus_drive.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <thread>

#include "models/base/setup_error.hpp"

namespace proxarm::fieldbus {
namespace {

using description::ModbusValue;
using description::SetupError;

DriveFault fault_of(ModbusResult result) noexcept {
  switch (result) {
    case ModbusResult::ok:
      return DriveFault::none;
    case ModbusResult::timeout:
      return DriveFault::modbus_timeout;
    case ModbusResult::closed:
      return DriveFault::modbus_closed;
    case ModbusResult::exception:
      return DriveFault::modbus_exception;
    case ModbusResult::wrong_unit:
      return DriveFault::modbus_wrong_unit;
    case ModbusResult::malformed:
      return DriveFault::modbus_malformed;
  }
  return DriveFault::modbus_malformed;
}

std::int64_t to_ns(double seconds) noexcept { return std::llround(1e9 * seconds); }

std::int64_t as_signed(std::int64_t value, int registers) noexcept {
  return registers == 1 ? static_cast<std::int64_t>(static_cast<std::int16_t>(value))
                        : static_cast<std::int64_t>(static_cast<std::int32_t>(value));
}

}  // namespace

ModbusDrive::ModbusDrive(const description::DriveDescription& drive,
                         const description::ModbusDriveDescription& registers, std::int64_t period_ns)
    : description_(drive),
      registers_(registers),
      scale_(drive),
      period_ns_(period_ns),
      stale_ns_(to_ns(registers.stale_after_s)) {
  const double a = *scale_.counts(drive.range_rad[0]), b = *scale_.counts(drive.range_rad[1]);
  low_counts_ = std::min(a, b);
  high_counts_ = std::max(a, b);
  for (const ModbusValue& value : registers.command) {
    if (value.signal != ModbusValue::Signal::position || value.registers == 2) continue;
    if (low_counts_ * value.scale >= -32768.0 && high_counts_ * value.scale <= 32767.0) continue;
    throw SetupError({.file = registers.file.string(),
                      .key = "command.values",
                      .found = "a position in one register",
                      .expected = "two registers for the range of " + drive.joint});
  }
}

bool ModbusDrive::has_control() const noexcept {
  return std::any_of(registers_.command.begin(), registers_.command.end(),
                     [](const ModbusValue& v) { return v.signal == ModbusValue::Signal::control; });
}

// ---- worker thread --------------------------------------------------------------------------------------------------

double ModbusDrive::resampled(const Setpoint& setpoint, std::int64_t now_ns, std::int64_t exchange_ns) const noexcept {
  if (!setpoint.follow) return answer_.position_counts;
  const std::int64_t most_ns = 2 * exchange_ns;
  const std::int64_t ahead_ns =
      std::clamp(now_ns + exchange_ns - (setpoint.time_ns + 2 * period_ns_), -most_ns, most_ns);
  const double counts = setpoint.counts + setpoint.counts_per_s * 1e-9 * static_cast<double>(ahead_ns);
  return std::clamp(std::round(counts), low_counts_, high_counts_);
}

void ModbusDrive::put(std::span<std::uint16_t> out, int registers, std::int64_t value) const noexcept {
  if (registers == 1) {
    out[0] = static_cast<std::uint16_t>(value);
    return;
  }
  const auto bits = static_cast<std::uint32_t>(value);
  const auto high = static_cast<std::uint16_t>(bits >> 16), low = static_cast<std::uint16_t>(bits);
  out[0] = registers_.high_word_first ? high : low;
  out[1] = registers_.high_word_first ? low : high;
}

std::int32_t ModbusDrive::field(std::span<const std::uint16_t> values, std::uint16_t first,
                                const description::ModbusField& f) const noexcept {
  const std::size_t i = f.at - first;
  if (f.registers == 1) return static_cast<std::int16_t>(values[i]);
  const std::uint32_t high = values[registers_.high_word_first ? i : i + 1];
  const std::uint32_t low = values[registers_.high_word_first ? i + 1 : i];
  return static_cast<std::int32_t>(high << 16 | low);
}

std::size_t ModbusDrive::encode(const Setpoint& setpoint, std::int64_t now_ns, std::int64_t exchange_ns,
                                std::span<std::uint16_t> out) noexcept {
  using Signal = ModbusValue::Signal;
  const double counts = resampled(setpoint, now_ns, exchange_ns);
  const double speed = std::abs(counts - sent_counts_) / (1e-9 * static_cast<double>(exchange_ns));
  sent_counts_ = counts;
  std::size_t at = 0;
  for (const ModbusValue& v : registers_.command) {
    const double most = v.registers == 1 ? 32767.0 : std::numeric_limits<std::int32_t>::max();
    std::int64_t value = v.value;
    if (v.signal == Signal::position) value = std::llround(counts * v.scale);
    if (v.signal == Signal::speed) {
      value = std::max(v.value, static_cast<std::int64_t>(std::min(most, std::ceil(speed * v.scale))));
    }
    if (v.signal == Signal::control) value = setpoint.drive_it ? registers_.control_on : registers_.control_off;
    put(out.subspan(at), v.registers, value);
    at += static_cast<std::size_t>(v.registers);
  }
  return at;
}

// Reads the feedback. If there is a command, writes it in the same exchange.
ModbusResult ModbusDrive::talk(ModbusClient& client, std::span<const std::uint16_t> command) noexcept {
  const std::uint8_t unit = description_.node;
  const std::span<std::uint16_t> values(read_.data(), static_cast<std::size_t>(registers_.feedback_count));
  ModbusResult result = ModbusResult::ok;
  if (command.empty()) {
    result = client.read(unit, registers_.feedback_register, values);
  } else if (registers_.function_23) {
    result = client.read_write(unit, registers_.feedback_register, values, registers_.command_register, command);
  } else {
    result = client.write(unit, registers_.command_register, command);
    if (result == ModbusResult::ok) result = client.read(unit, registers_.feedback_register, values);
  }
  if (result != ModbusResult::ok) return result;
  answer_.position_counts = field(values, registers_.feedback_register, registers_.position);
  if (!registers_.status_apart()) {
    answer_.status = static_cast<std::uint32_t>(field(values, registers_.feedback_register, registers_.status));
  } else if (++exchanges_since_status_ >= registers_.status_every || !status_known_) {
    std::array<std::uint16_t, 2> status{};
    const std::span<std::uint16_t> word(status.data(), static_cast<std::size_t>(registers_.status.registers));
    result = client.read(unit, registers_.status.at, word);
    if (result != ModbusResult::ok) return result;
    exchanges_since_status_ = 0;
    status_known_ = true;
    answer_.status = static_cast<std::uint32_t>(field(word, registers_.status.at, registers_.status));
  }
  if (registers_.status.registers == 1) answer_.status &= 0xFFFF;
  return result;
}

bool ModbusDrive::exchange(ModbusClient& client, std::int64_t now_ns, std::int64_t exchange_ns) noexcept {
  if (setpoints_.read(setpoint_)) cycling_ = true;
  if (cycling_ && now_ns - setpoint_.time_ns > stale_ns_) return false;
  std::array<std::uint16_t, modbus_most_written> command{};
  std::size_t count = 0;
  // A drive without a control word moves as soon as a position is written to it, so nothing is written while it shall
  // stand.
  const bool writes = cycling_ && (has_control() || setpoint_.follow);
  if (writes) count = encode(setpoint_, now_ns, exchange_ns, command);
  const ModbusResult result = talk(client, {command.data(), count});
  note(result, client.exception(), now_ns);
  if (!writes || !setpoint_.follow) sent_counts_ = answer_.position_counts;
  return true;
}

// Counts the answer's result. These results are tolerated until the last good answer is older than stale_after_s: a
// late or corrupted answer (noise on the line), and exception 6 (a busy gateway that asks for a repetition). Any other
// exception, a closed connection, or an answer of another unit is a fault at once.
void ModbusDrive::note(ModbusResult result, int exception, std::int64_t now_ns) noexcept {
  if (result == ModbusResult::ok) {
    const double interval_s = 1e-9 * static_cast<double>(now_ns - last_answer_ns_);
    if (answered_ && interval_s > 0.0) {
      constexpr double share = 1.0 / 16.0;  // weight of the newest interval in the mean
      const double mean_s = answer_.rate_Hz > 0.0 ? 1.0 / answer_.rate_Hz : interval_s;
      answer_.rate_Hz = 1.0 / (mean_s + share * (interval_s - mean_s));
    }
    last_answer_ns_ = now_ns;
    answered_ = true;
    answer_.time_ns = now_ns;
    answer_.noise = DriveFault::none;
  } else {
    const bool busy = result == ModbusResult::exception && exception == modbus_busy;
    const bool noise = result == ModbusResult::timeout || result == ModbusResult::malformed || busy;
    answer_.noise = busy ? DriveFault::modbus_timeout : fault_of(result);
    if (answer_.fault == DriveFault::none && (!noise || now_ns - last_answer_ns_ > stale_ns_)) {
      answer_.fault = fault_of(result);
      answer_.exception = exception;
    }
  }
  feedbacks_.write(answer_);
}

bool ModbusDrive::in_range(std::int32_t counts) const noexcept {
  constexpr double beyond = 0.05;  // tolerance, as a share of the range
  const double more = beyond * (high_counts_ - low_counts_);
  return counts >= low_counts_ - more && counts <= high_counts_ + more;
}

void ModbusDrive::judge_word_order() {
  if (registers_.position.registers == 1) {
    word_order_shown_ = true;
    return;
  }
  const std::int32_t read = answer_.position_counts;
  const auto bits = static_cast<std::uint32_t>(read);
  const auto swapped = static_cast<std::int32_t>(bits << 16 | bits >> 16);
  word_order_shown_ = in_range(read) && !in_range(swapped);
  if (in_range(read) || !in_range(swapped)) return;
  throw SetupError(
      {.bus = description_.bus,
       .node = description_.node,
       .message = "drive of " + description_.joint + ": position, register " + std::to_string(registers_.position.at),
       .found = std::to_string(read) + " counts, out of range_rad; with the words in the other order " +
                std::to_string(swapped) + ", which is in it",
       .expected = "a position in range_rad",
       .advice = "is word_order in " + registers_.file.string() + " the other one? Nothing was sent to move"});
}

void ModbusDrive::start_up(ModbusClient& client, std::int64_t now_ns) {
  const auto require = [&](ModbusResult result, const std::string& what, const std::string& register_text) {
    if (result == ModbusResult::ok) return;
    std::string found = to_string(fault_of(result));
    if (result == ModbusResult::exception) {
      found = "exception " + std::to_string(client.exception()) + ", " + modbus_exception_name(client.exception());
    }
    throw SetupError({.bus = description_.bus,
                      .node = description_.node,
                      .message = "drive of " + description_.joint + ": " + what + register_text,
                      .found = found,
                      .expected = "an answer",
                      .advice = "compare unit, baud rate and registers with " + registers_.file.string()});
  };
  // Repeats the request up to ten times while the gateway is busy.
  const auto asked = [&client](const auto& request) {
    ModbusResult result = request();
    for (int again = 0; again < 10 && result == ModbusResult::exception && client.exception() == modbus_busy; ++again) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
      result = request();
    }
    return result;
  };
  for (const description::ModbusSetting& setting : registers_.settings) {
    std::array<std::uint16_t, 2> words{}, read{};
    const auto count = static_cast<std::size_t>(setting.registers);
    put(words, setting.registers, setting.value);
    const std::string place = ", register " + std::to_string(setting.at);
    require(asked([&] {
              return client.write(description_.node, setting.at, {words.data(), count});
            }),
            setting.name, place);
    require(asked([&] {
              return client.read(description_.node, setting.at, {read.data(), count});
            }),
            setting.name, place);
    if (read == words) continue;
    const std::int64_t got =
        setting.registers == 1
            ? std::int64_t{read[0]}
            : std::int64_t{field({read.data(), count}, setting.at, {.at = setting.at, .registers = 2})};
    throw SetupError({.bus = description_.bus,
                      .node = description_.node,
                      .message = "drive of " + description_.joint + ": " + setting.name + place + ", read back",
                      .found = std::to_string(got),
                      .expected = std::to_string(as_signed(setting.value, setting.registers))});
  }
  require(asked([&] { return talk(client, {}); }), "position and status", "");
  judge_word_order();
  note(ModbusResult::ok, 0, now_ns);
  sent_counts_ = answer_.position_counts;
}

// ---- cycle thread ---------------------------------------------------------------------------------------------------

void ModbusDrive::raise(DriveFault fault) noexcept {
  if (fault_ == DriveFault::none) fault_ = fault;
}

void ModbusDrive::on_sync(std::int64_t now_ns) noexcept {
  now_ns_ = now_ns;
  feedbacks_.read(feedback_);
  fresh_ = now_ns - feedback_.time_ns <= stale_ns_;
  judge();
  if (!following_) target_counts_ = feedback_.position_counts;
}

void ModbusDrive::archive_input(StateArchive& state) noexcept {
  Feedback feedback = feedback_;
  state(feedback);
  if (state.reading()) feedbacks_.write(feedback);
}

void ModbusDrive::judge() noexcept {
  const std::uint32_t status = feedback_.status;
  const bool wanted = goal_ == DriveGoal::operation_enabled;
  const bool enabled = (status & registers_.enabled_mask) == registers_.enabled_value && (wanted || has_control());
  const bool was_following = following_;
  if ((status & registers_.fault_mask) != 0) {
    state_ = DriveState::fault;
  } else if (enabled) {
    state_ = DriveState::operation_enabled;
  } else {
    state_ = (status & registers_.ready_mask) == registers_.ready_value ? DriveState::switched_on
                                                                        : DriveState::switch_on_disabled;
  }
  following_ = wanted && state_ == DriveState::operation_enabled;
  if (!wanted) return;
  if (state_ == DriveState::fault) raise(DriveFault::state_fault);
  if (feedback_.fault != DriveFault::none) raise(feedback_.fault);
  if (!fresh_) raise(feedback_.noise == DriveFault::none ? DriveFault::modbus_timeout : feedback_.noise);
  if (was_following && !following_) raise(DriveFault::left_operation);
}

bool ModbusDrive::set_target_rad(double angle_rad) noexcept {
  Setpoint setpoint{.time_ns = now_ns_, .counts = static_cast<double>(feedback_.position_counts)};
  setpoint.drive_it = goal_ == DriveGoal::operation_enabled;
  const auto counts = scale_.counts(angle_rad);
  if (following_ && !counts) raise(DriveFault::target_out_of_range);
  const bool taken = following_ && counts.has_value();
  if (taken) {
    const double exact = angle_rad * scale_.counts_per_rad();
    setpoint.follow = true;
    setpoint.counts = *counts;
    setpoint.counts_per_s = (exact - previous_target_) / (1e-9 * static_cast<double>(period_ns_));
    previous_target_ = exact;
    target_counts_ = *counts;
  } else {
    previous_target_ = scale_.counts_per_rad() * actual_rad();
  }
  setpoints_.write(setpoint);
  return taken;
}

std::string ModbusDrive::describe() const {
  std::string text = "drive of " + description_.joint + " (Modbus line " + description_.bus + ", unit " +
                     std::to_string(description_.node) + "): status " + std::to_string(feedback_.status) + ", " +
                     description::number_text(std::round(feedback_.rate_Hz)) + " exchanges/s";
  if (fault_ != DriveFault::none) text += std::string("; ") + to_string(fault_);
  if (fault_ == DriveFault::modbus_exception) {
    text += " " + std::to_string(feedback_.exception) + " (" + modbus_exception_name(feedback_.exception) + ")";
  }
  return text;
}

}  // namespace proxarm::fieldbus
