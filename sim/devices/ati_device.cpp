#include "sim/devices/ati_device.hpp"

#include <algorithm>
#include <bit>

namespace proxarm::sim {

namespace {

constexpr std::uint8_t newton = 2, newton_metre = 3;
constexpr std::uint8_t calibrations = 1;  // number of calibrations stored in this sensor
constexpr std::uint16_t any_error = 0x8000;
// Plausible converter voltages in ADC counts.
constexpr std::array<std::uint16_t, 6> voltages{2048, 2048, 3100, 2900, 2048, 1024};

void put_u16(std::span<std::uint8_t> to, std::size_t at, std::uint16_t value) noexcept {
  to[at] = static_cast<std::uint8_t>(value >> 8);
  to[at + 1] = static_cast<std::uint8_t>(value);
}

void put_u32(std::span<std::uint8_t> to, std::size_t at, std::uint32_t value) noexcept {
  put_u16(to, at, static_cast<std::uint16_t>(value >> 16));
  put_u16(to, at + 2, static_cast<std::uint16_t>(value));
}

}  // namespace

AtiDevice::AtiDevice(const AtiDeviceConfig& config, GaugeSource& gauges, DevicePort& port)
    : config_(config), gauges_(gauges), port_(port) {
  config_.serial_number.resize(8, ' ');
}

void AtiDevice::power_on(std::int64_t time_ns) noexcept { ready_ns_ = time_ns + config_.start_time_ns; }

void AtiDevice::on_frame(const fieldbus::CanFrame& frame, std::int64_t time_ns) noexcept {
  if (frame.extended || frame.remote || frame.error || frame.fd || frame.id >> 4 != config_.base_id) return;
  if (time_ns < ready_ns_ || faults_.silent) return;
  const auto operation = static_cast<std::uint8_t>(frame.id & 0x0F);
  const bool empty = frame.length == 0, one_byte = frame.length == 1;
  const std::uint8_t argument = frame.data[0];
  std::array<std::uint8_t, 8> bytes{};
  if (operation == 0x0 && empty) {
    send_sample(time_ns);
  } else if (operation == 0x2 && one_byte && argument < 6) {
    send_matrix_row(argument, time_ns);
  } else if (operation == 0x5 && empty) {
    std::copy_n(config_.serial_number.begin(), 8, bytes.begin());
    answer(operation, bytes, time_ns);
  } else if (operation == 0x6 && one_byte) {
    if (argument < calibrations) calibration_ = argument;
    answer(operation, {&calibration_, 1}, time_ns);
  } else if (operation == 0x7 && empty) {
    put_u32(bytes, 0, config_.counts_per_force);
    put_u32(bytes, 4, config_.counts_per_torque);
    answer(operation, bytes, time_ns);
  } else if (operation == 0x8 && empty) {
    bytes[0] = newton;
    bytes[1] = newton_metre;
    answer(operation, std::span(bytes).first(2), time_ns);
  } else if (operation == 0x9 && one_byte && argument < voltages.size()) {
    put_u16(bytes, 0, voltages[argument]);
    answer(operation, std::span(bytes).first(2), time_ns);
  } else if (operation == 0xC && empty) {
    power_on(time_ns);
  } else if (operation == 0xF && empty) {
    bytes = {1, 0, 0, 42};
    answer(operation, std::span(bytes).first(4), time_ns);
  }
}

void AtiDevice::answer(std::uint8_t operation, std::span<const std::uint8_t> bytes, std::int64_t time_ns) noexcept {
  fieldbus::CanFrame frame;
  frame.id = config_.base_id << 4 | operation;
  frame.length = static_cast<std::uint8_t>(bytes.size());
  std::copy(bytes.begin(), bytes.end(), frame.data.begin());
  port_.send(frame, time_ns + config_.answer_time_ns + faults_.delay_ns);
}

void AtiDevice::send_sample_frame(std::uint8_t operation, std::span<const std::uint8_t> bytes,
                                  std::int64_t time_ns) noexcept {
  if (faults_.lost_one_in > 0 && ++frames_ % faults_.lost_one_in == 0) return;
  if (faults_.short_frames) bytes = bytes.first(bytes.size() - 1);
  answer(operation, bytes, time_ns);
  if (faults_.duplicated) answer(operation, bytes, time_ns);
}

void AtiDevice::send_sample(std::int64_t time_ns) noexcept {
  if (faults_.silent_samples) return;
  if (!faults_.frozen) {
    const std::array<std::int16_t, 6> before = last_;
    last_ = gauges_.gauges(time_ns);
    if (faults_.stuck_channel >= 0) {
      const auto stuck = static_cast<std::size_t>(faults_.stuck_channel);
      last_[stuck] = before[stuck];
    }
  }
  if (faults_.saturated) last_[0] = 32767;
  std::array<std::uint8_t, 8> first{};
  std::array<std::uint8_t, 6> second{};
  put_u16(first, 0, static_cast<std::uint16_t>(faults_.status_bits == 0 ? 0 : faults_.status_bits | any_error));
  for (std::size_t i = 0; i < 3; ++i) {
    put_u16(first, 2 + 2 * i, static_cast<std::uint16_t>(last_[2 * i]));
    put_u16(second, 2 * i, static_cast<std::uint16_t>(last_[2 * i + 1]));
  }
  if (faults_.swapped && !faults_.half_sample) send_sample_frame(1, second, time_ns);
  send_sample_frame(0, first, time_ns);
  if (!faults_.swapped && !faults_.half_sample) send_sample_frame(1, second, time_ns);
}

void AtiDevice::send_matrix_row(std::size_t row, std::int64_t time_ns) noexcept {
  for (std::size_t pair = 0; pair < 3; ++pair) {
    std::array<std::uint8_t, 8> bytes{};
    put_u32(bytes, 0, std::bit_cast<std::uint32_t>(config_.matrix[row][2 * pair]));
    put_u32(bytes, 4, std::bit_cast<std::uint32_t>(config_.matrix[row][2 * pair + 1]));
    answer(static_cast<std::uint8_t>(2 + pair), bytes, time_ns);
  }
}

}  // namespace proxarm::sim
