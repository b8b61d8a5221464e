#include "sim/devices/described_device.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "models/base/setup_error.hpp"
#include "models/geometry/linear_systems.hpp"

namespace proxarm::sim {
namespace {

using description::NumberField;
using description::NumberKind;
using description::SensorCommand;
using fieldbus::CanFrame;

// Returns the number of bytes in a command's first frame, which is at most eight.
std::size_t first_bytes(const SensorCommand& command) { return std::min<std::size_t>(command.data.size(), 8); }

bool is_value_byte(const SensorCommand& command, std::size_t at) noexcept {
  return command.value && at >= command.value->byte && at < command.value->byte + command.value->bytes();
}

}  // namespace

DescribedDevice::DescribedDevice(const description::SensorDescription& sensor, const DescribedDeviceConfig& config,
                                 WrenchSource& source, DevicePort& port)
    : protocol_(sensor.described.value_or(description::SensorProtocol{})),
      config_(config),
      source_(source),
      port_(port),
      sample_(protocol_.sample_bytes()) {
  signals_of_wrench_.assign(6, {});
  for (std::size_t i = 0; i < 6; ++i) signals_of_wrench_[i][i] = 1.0;
  if (protocol_.matrix_columns.empty()) return;
  models::Mat6 matrix = models::Mat6::Zero();
  const std::size_t columns = protocol_.matrix_columns.size();
  for (std::size_t column = 0; columns == 6 && column < 6; ++column) {
    for (std::size_t row = 0; row < 6; ++row) {
      matrix(static_cast<Eigen::Index>(row), static_cast<Eigen::Index>(column)) = protocol_.matrix_columns[column][row];
    }
  }
  const std::optional<models::Mat6> inverse = models::inverse_if_regular(matrix);
  if (!inverse) {
    throw description::SetupError(
        {.file = sensor.file.string(),
         .key = "matrix",
         .message = "only a sensor with an invertible matrix of six columns can be simulated"});
  }
  for (std::size_t row = 0; row < 6; ++row) {
    for (std::size_t column = 0; column < 6; ++column) {
      signals_of_wrench_[row][column] = (*inverse)(static_cast<Eigen::Index>(row), static_cast<Eigen::Index>(column));
    }
  }
}

void DescribedDevice::power_on(std::int64_t time_ns) noexcept {
  ready_ns_ = time_ns + config_.start_time_ns;
  period_ns_ = protocol_.rate_Hz > 0.0 ? std::llround(1e9 / protocol_.rate_Hz) : 0;
  streaming_ = protocol_.streams() && !protocol_.start;
  bias_ = {};
  count_ = 0;
}

// ---- Commands

bool DescribedDevice::is(const std::optional<SensorCommand>& command, const CanFrame& frame) const noexcept {
  if (!command || frame.id != command->id + config_.base_id * protocol_.base_id_step) return false;
  const std::size_t bytes = first_bytes(*command);
  if (frame.length < bytes || (bytes == 0 && frame.length > 0)) return false;
  for (std::size_t i = 0; i < bytes; ++i) {
    if (frame.data[i] != command->data[i] && !is_value_byte(*command, i)) return false;
  }
  return true;
}

void DescribedDevice::obey_rate(const CanFrame& frame) noexcept {
  if (!protocol_.rate->value) return;
  const NumberField& number = *protocol_.rate->value;
  double value = 0.0;
  for (std::size_t i = 0; i < number.bytes(); ++i) {
    const std::size_t at = number.byte + (number.big_endian ? i : number.bytes() - 1 - i);
    value = value * 256.0 + frame.data[at];
  }
  value = std::floor(value / std::ldexp(1.0, number.shift));
  if (value > 0.0) period_ns_ = std::max<std::int64_t>(10'000, std::llround(1e9 * value / protocol_.rate->divides_Hz));
}

void DescribedDevice::on_frame(const CanFrame& frame, std::int64_t time_ns) noexcept {
  if (frame.error || frame.remote || frame.extended != protocol_.extended || frame.fd != protocol_.fd) return;
  if (time_ns < ready_ns_ || faults_.silent) return;
  if (is(protocol_.poll, frame)) return send_sample(time_ns + config_.answer_time_ns);
  // The commands are checked in the order in which a master sends them. If stop and rate differ only in the value, the
  // value 0 means stop.
  if (is(protocol_.start, frame)) {
    if (protocol_.datagrams) count_ = 1;  // a stream of datagrams is counted from its start
    streaming_ = true;
  } else if (is(protocol_.stop, frame)) {
    streaming_ = false;
  } else if (is(protocol_.bias, frame)) {
    bias_ = source_.wrench(time_ns);
  } else if (is(protocol_.clear_bias, frame)) {
    bias_ = {};
  } else if (is(protocol_.rate, frame)) {
    obey_rate(frame);
    if (!protocol_.start) streaming_ = true;
  }
}

// ---- Samples

void DescribedDevice::on_converter(std::int64_t time_ns) noexcept {
  if (streaming_ && time_ns >= ready_ns_ && !faults_.silent) send_sample(time_ns);
}

// Stores the value at the number's place in the sample. Bit i of the number is `shift + i` bits above the lowest bit of
// the number's lowest byte.
void DescribedDevice::put(const NumberField& number, std::uint64_t value) noexcept {
  for (int i = 0; i < number.bits; ++i) {
    const auto above = static_cast<std::size_t>(number.shift + i);
    const std::size_t at = number.big_endian ? number.byte + number.bytes() - 1 - above / 8 : number.byte + above / 8;
    const auto bit = static_cast<std::uint8_t>(1U << above % 8);
    sample_[at] = static_cast<std::uint8_t>((value >> i & 1U) != 0 ? sample_[at] | bit : sample_[at] & ~bit);
  }
}

void DescribedDevice::fill_signals(std::int64_t time_ns) noexcept {
  if (!faults_.frozen) measured_ = source_.wrench(time_ns);
  for (std::size_t i = 0; i < protocol_.signals.size() && i < 6; ++i) {
    const description::SensorSignal& signal = protocol_.signals[i];
    double value = 0.0;
    for (std::size_t k = 0; k < 6; ++k) value += signals_of_wrench_[i][k] * (measured_[k] - bias_[k]);
    double number = (value - signal.offset) / signal.scale;
    if (faults_.saturated && i == 0) number = signal.saturated_above;
    if (faults_.stuck_channel == static_cast<int>(i)) number = numbers_[i];
    numbers_[i] = number;
    if (signal.number.kind == NumberKind::real) {
      put(signal.number, std::bit_cast<std::uint32_t>(static_cast<float>(number)));
    } else {
      const double ends[] = {signal.number.lowest(), signal.number.highest()};
      put(signal.number, static_cast<std::uint64_t>(std::llround(std::clamp(number, ends[0], ends[1]))));
    }
  }
}

void DescribedDevice::fill_checksum() noexcept {
  if (!protocol_.checksum) return;
  const description::SensorChecksum& rule = *protocol_.checksum;
  using description::ChecksumKind;
  const int width = rule.kind == ChecksumKind::crc16 ? 16 : 8;
  std::uint64_t sum = rule.initial;
  for (std::size_t at = rule.from; at < rule.to; ++at) {
    if (rule.kind == ChecksumKind::sum8 || rule.kind == ChecksumKind::sum16) {
      sum += sample_[at];
    } else if (rule.kind == ChecksumKind::xor8) {
      sum ^= sample_[at];
    } else {
      // Long division: appends eight bits to the remainder of the bytes before.
      for (int bit = 7; bit >= 0; --bit) {
        const bool top = ((sum >> (width - 1)) & 1U) != (static_cast<std::uint64_t>(sample_[at]) >> bit & 1U);
        sum = (sum << 1 & ((std::uint64_t{1} << width) - 1)) ^ (top ? rule.polynomial : 0U);
      }
    }
  }
  put(rule.number, faults_.bad_checksum ? sum + 1 : sum);
}

void DescribedDevice::fill(std::int64_t time_ns) noexcept {
  std::fill(sample_.begin(), sample_.end(), std::uint8_t{0});
  std::size_t at = 0;
  for (const description::SampleFrame& frame : protocol_.frames) {
    std::copy(frame.starts_with.begin(), frame.starts_with.end(), sample_.begin() + static_cast<std::ptrdiff_t>(at));
    at += frame.bytes;
  }
  if (protocol_.counter) put(*protocol_.counter, count_);
  if (protocol_.reading_counter) put(*protocol_.reading_counter, count_);
  // A sensor on UDP counts its datagrams, even if their readings are frozen.
  if (!faults_.frozen || protocol_.datagrams) ++count_;
  if (protocol_.status) put(protocol_.status->number, faults_.status_bits);
  fill_signals(time_ns);
  fill_checksum();
}

void DescribedDevice::send_part(std::size_t part, std::int64_t time_ns) noexcept {
  if (faults_.lost_one_in > 0 && ++frames_ % faults_.lost_one_in == 0) return;
  std::size_t at = 0;
  for (std::size_t i = 0; i < part; ++i) at += protocol_.frames[i].bytes;
  CanFrame frame;
  frame.id = protocol_.frames[part].id + config_.base_id * protocol_.base_id_step;
  frame.extended = protocol_.extended;
  frame.fd = protocol_.fd;
  frame.bit_rate_switch = protocol_.bit_rate_switch;
  frame.length = protocol_.frames[part].bytes;
  if (faults_.short_frames && (frame.length <= 8 || protocol_.datagrams)) --frame.length;
  std::copy_n(sample_.begin() + static_cast<std::ptrdiff_t>(at), frame.length, frame.data.begin());
  for (int copies = faults_.duplicated ? 2 : 1; copies > 0; --copies) port_.send(frame, time_ns + faults_.delay_ns);
}

void DescribedDevice::send_sample(std::int64_t time_ns) noexcept {
  if (faults_.silent_samples) return;
  fill(time_ns);
  const std::size_t parts = protocol_.frames.size();
  for (std::size_t i = 0; i < parts; ++i) {
    const std::size_t part = faults_.swapped ? parts - 1 - i : i;
    if (faults_.half_sample && part + 1 == parts && parts > 1) continue;
    send_part(part, time_ns);
  }
}

}  // namespace proxarm::sim
