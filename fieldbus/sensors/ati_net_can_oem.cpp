#include "fieldbus/sensors/ati_net_can_oem.hpp"

#include "fieldbus/can/byte_order.hpp"

namespace proxarm::fieldbus {
namespace {

constexpr std::uint8_t op_gauges_even = 0x0;  // answer with status, SG0, SG2, SG4; also the request for a sample
constexpr std::uint8_t op_gauges_odd = 0x1;   // answer with SG1, SG3, SG5

}  // namespace

bool AtiNetCanOem::poll(std::int64_t now_ns, CanFrame& frame) noexcept {
  older_poll_ns_ = polled_ ? poll_ns_ : now_ns;
  poll_ns_ = now_ns;
  polled_ = true;
  fresh_ = false;
  frame = CanFrame{};
  frame.id = id(op_gauges_even);
  return true;
}

bool AtiNetCanOem::in_time(std::int64_t time_ns) const noexcept {
  return polled_ && time_ns >= older_poll_ns_ && !answered();
}

bool AtiNetCanOem::fits_half(std::int64_t time_ns) const noexcept {
  const bool poll_between = half_ns_ < poll_ns_ && time_ns >= poll_ns_;
  return half_ && (!poll_between || time_ns - half_ns_ <= (poll_ns_ - older_poll_ns_) / 2);
}

void AtiNetCanOem::drop_half() noexcept {
  if (half_) ++incomplete_;
  half_ = false;
}

bool AtiNetCanOem::on_frame(const CanFrame& frame, std::int64_t time_ns) noexcept {
  if (frame.id >> 4 != settings_.base_id || frame.extended || frame.remote || frame.error) return false;
  const std::uint8_t op = frame.id & 0xF;
  if (op > op_gauges_odd) return true;  // this frame answers a request of the set-up
  if (frame.length != (op == op_gauges_even ? 8 : 6)) {
    ++wrong_lengths_;
    return true;
  }
  if (!in_time(time_ns)) {
    ++dropped_;
    return true;
  }
  if (op == op_gauges_even) {
    drop_half();  // op 1 of the sample before was lost
    half_ns_ = time_ns;
    half_status_ = read_u16_be(&frame.data[0]);
    for (std::size_t i = 0; i < 3; ++i) half_gauges_[2 * i] = read_i16_be(&frame.data[2 + 2 * i]);
    half_ = true;
    return true;
  }
  if (!fits_half(time_ns)) {
    drop_half();
    ++dropped_;
    return true;
  }
  for (std::size_t i = 0; i < 3; ++i) half_gauges_[2 * i + 1] = read_i16_be(&frame.data[2 * i]);
  half_ = false;
  complete(time_ns);
  return true;
}

void AtiNetCanOem::complete(std::int64_t time_ns) noexcept {
  latest_.repeats = latest_.number > 0 && half_gauges_ == gauges_ ? latest_.repeats + 1 : 0;
  gauges_ = half_gauges_;
  std::array<double, 6> counts{};
  for (std::size_t i = 0; i < 6; ++i) counts[i] = gauges_[i];
  channels_.add(counts);
  latest_.channel_repeats = channels_.repeats();
  latest_.time_ns = time_ns;
  latest_.late = half_ns_ < poll_ns_;
  if (latest_.late) ++late_;
  latest_.status = half_status_;
  latest_.healthy = half_status_ == 0;
  latest_.saturated = false;
  ++latest_.number;
  fresh_ = true;
  for (const std::int16_t gauge : gauges_) {
    if (gauge >= settings_.rail_counts || gauge <= -settings_.rail_counts) latest_.saturated = true;
  }
  for (std::size_t row = 0; row < 6; ++row) {
    double sum = 0.0;
    for (std::size_t i = 0; i < 6; ++i) sum += scaled_[row][i] * gauges_[i];
    latest_.wrench_S[row] = sum;
  }
}

}  // namespace proxarm::fieldbus
