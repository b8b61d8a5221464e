#include "fieldbus/sensors/described_sensor.hpp"

#include <algorithm>
#include <bit>
#include <boost/crc.hpp>
#include <cmath>
#include <functional>
#include <numeric>
#include <span>

namespace proxarm::fieldbus {

namespace {

std::uint32_t checksum_of(const description::SensorChecksum& rule, std::span<const std::uint8_t> bytes) noexcept {
  using description::ChecksumKind;
  const auto crc = [&](auto remainder) {
    remainder.process_bytes(bytes.data(), bytes.size());
    return static_cast<std::uint32_t>(remainder.checksum());
  };
  switch (rule.kind) {
    case ChecksumKind::crc8:
      return crc(
          boost::crc_basic<8>(static_cast<std::uint8_t>(rule.polynomial), static_cast<std::uint8_t>(rule.initial)));
    case ChecksumKind::crc16:
      return crc(
          boost::crc_basic<16>(static_cast<std::uint16_t>(rule.polynomial), static_cast<std::uint16_t>(rule.initial)));
    case ChecksumKind::xor8:
      return std::accumulate(bytes.begin(), bytes.end(), 0U, std::bit_xor<std::uint32_t>());
    case ChecksumKind::sum8:
    case ChecksumKind::sum16:
      break;
  }
  return std::accumulate(bytes.begin(), bytes.end(), 0U);
}

}  // namespace

// ---- Numbers

DescribedSensor::Slice DescribedSensor::slice_of(const description::NumberField& number) noexcept {
  Slice slice;
  slice.byte = static_cast<std::uint16_t>(number.byte);
  slice.bytes = static_cast<std::uint8_t>(number.bytes());
  slice.shift = static_cast<std::uint8_t>(number.shift);
  slice.big_endian = number.big_endian;
  slice.is_signed = number.kind == description::NumberKind::signed_integer;
  slice.real = number.kind == description::NumberKind::real;
  slice.mask = (std::uint64_t{1} << number.bits) - 1;
  slice.sign = std::uint64_t{1} << (number.bits - 1);
  return slice;
}

std::uint64_t DescribedSensor::bits_of(const Slice& slice) const noexcept {
  std::uint64_t word = 0;
  for (std::size_t i = 0; i < slice.bytes; ++i) {
    const std::size_t at = slice.byte + (slice.big_endian ? i : slice.bytes - 1U - i);
    word = word << 8 | sample_[at];
  }
  return word >> slice.shift & slice.mask;
}

double DescribedSensor::number_of(const Slice& slice) const noexcept {
  const std::uint64_t bits = bits_of(slice);
  if (slice.real) return static_cast<double>(std::bit_cast<float>(static_cast<std::uint32_t>(bits)));
  if (slice.is_signed && (bits & slice.sign) != 0) return -static_cast<double>((~bits & slice.mask) + 1);
  return static_cast<double>(bits);
}

// ---- Assembly

bool DescribedSensor::poll(std::int64_t now_ns, CanFrame& frame) noexcept {
  fresh_ = false;
  older_poll_ns_ = polled_ ? poll_ns_ : now_ns;
  poll_ns_ = now_ns;
  polled_ = true;
  if (streams_) return false;
  torn_ = false;
  frame = poll_frame_;
  return true;
}

bool DescribedSensor::fits(std::size_t slot, const CanFrame& frame) const noexcept {
  const Slot& wanted = slots_[slot];
  return frame.id == wanted.id && frame.length == wanted.bytes &&
         std::equal(wanted.head.begin(), wanted.head.begin() + wanted.head_bytes, frame.data.begin());
}

// True if the frame repeats the frame before it. If the next expected frame could have the same content, a repetition
// can only be recognised by a header.
bool DescribedSensor::repeats_last(const CanFrame& frame) const noexcept {
  if (next_ == 0) return false;
  const Slot& last = slots_[next_ - 1];
  return frame.id == last.id && frame.length == last.bytes && (last.own_head || !fits(next_, frame)) &&
         std::equal(frame.data.begin(), frame.data.begin() + last.bytes, sample_.begin() + last.at);
}

bool DescribedSensor::in_time(std::int64_t time_ns) const noexcept {
  if (streams_) return time_ns >= poll_ns_ - settings_.oldest_sample_ns;
  return polled_ && time_ns >= older_poll_ns_ && !answered();
}

// True if a frame at time_ns can belong to the sample that has begun. If a poll came between the frames of a polled
// sensor, they must be at most half a period apart, because frames of different samples are a whole period apart.
bool DescribedSensor::came_together(std::int64_t time_ns) const noexcept {
  const std::int64_t took_ns = time_ns - begun_ns_;
  if (took_ns < 0 || took_ns > together_ns_) return false;
  const bool poll_between = !streams_ && begun_ns_ < poll_ns_ && time_ns >= poll_ns_;
  return !poll_between || took_ns <= (poll_ns_ - older_poll_ns_) / 2;
}

bool DescribedSensor::on_frame(const CanFrame& frame, std::int64_t time_ns) noexcept {
  if (frame.error || frame.remote || frame.extended != protocol_.extended) return false;
  const bool known = std::any_of(slots_.begin(), slots_.end(), [&](const Slot& slot) { return slot.id == frame.id; });
  if (!known) return false;
  // This check comes before repeats_last(): when the arm is at rest, the first frame of the next sample can equal the
  // last frame received to the bit.
  if (next_ > 0 && !came_together(time_ns)) tear();
  if (frame.fd != protocol_.fd || !in_time(time_ns) || repeats_last(frame)) {
    ++counts_.dropped;
    return true;
  }
  if (next_ > 0 && fits(next_, frame)) {
    take(next_, frame, time_ns);
  } else if (fits(0, frame)) {
    if (next_ > 0) tear();
    take(0, frame, time_ns);
  } else {
    if (next_ > 0) tear();
    refuse_frame(frame);
  }
  return true;
}

void DescribedSensor::take(std::size_t slot, const CanFrame& frame, std::int64_t time_ns) noexcept {
  if (slot == 0) begun_ns_ = time_ns;
  std::copy_n(frame.data.begin(), slots_[slot].bytes, sample_.begin() + slots_[slot].at);
  next_ = slot + 1;
  if (next_ < slots_.size()) return;
  next_ = 0;
  complete(time_ns);
}

void DescribedSensor::refuse_frame(const CanFrame& frame) noexcept {
  const bool has_length = std::any_of(slots_.begin(), slots_.end(), [&](const Slot& slot) {
    return slot.id == frame.id && slot.bytes == frame.length;
  });
  ++(has_length ? counts_.dropped : counts_.wrong_lengths);
}

void DescribedSensor::tear() noexcept {
  next_ = 0;
  torn_ = true;
  ++counts_.incomplete;
}

// ---- A whole sample

void DescribedSensor::complete(std::int64_t time_ns) noexcept {
  if (!checksum_is_right()) {
    ++counts_.bad_checksums;
    return;
  }
  const bool torn = torn_;
  torn_ = false;
  if (torn && streams_ && !order_is_certain_) {
    ++counts_.incomplete;
    return;
  }
  if (counter_moved()) decode(time_ns);
}

bool DescribedSensor::checksum_is_right() const noexcept {
  if (!protocol_.checksum) return true;
  const description::SensorChecksum& rule = *protocol_.checksum;
  const std::span<const std::uint8_t> bytes(sample_.data() + rule.from, rule.to - rule.from);
  return (checksum_of(rule, bytes) & checksum_.mask) == bits_of(checksum_);
}

// True if the sample's counter has increased. A step of at least half the counter's range counts as a step back: the
// sample is an older one that came late.
bool DescribedSensor::counter_moved() noexcept {
  if (!protocol_.counter) return true;
  const std::uint64_t count = bits_of(counter_);
  const std::uint64_t step = (count - last_count_) & counter_.mask;
  if (counted_ && (step == 0 || step >= counter_.sign)) {
    // A restarted sensor may count from any number. So a second sample in a row whose counter steps back is accepted.
    counted_ = step == 0;
    ++counts_.repeated;
    if (step == 0) ++latest_.repeats;
    return false;
  }
  if (counted_) counts_.lost += step - 1;
  counted_ = true;
  last_count_ = count;
  return true;
}

void DescribedSensor::decode(std::int64_t time_ns) noexcept {
  bool same = latest_.number > 0;
  latest_.saturated = false;
  for (std::size_t i = 0; i < channels_.size(); ++i) {
    const Channel& channel = channels_[i];
    const double number = number_of(channel.slice);
    same = same && number == numbers_[i];
    numbers_[i] = number;
    values_[i] = channel.scale * number + channel.offset;
    // The negated comparison is also true for NaN.
    if (!(number > channel.lowest && number < channel.highest)) latest_.saturated = true;
    if (identity_matrix_ && !(std::abs(values_[i]) <= range_[i])) latest_.saturated = true;
  }
  latest_.status = protocol_.status ? static_cast<std::uint32_t>(bits_of(status_)) : 0;
  latest_.healthy = !protocol_.status || (latest_.status & protocol_.status->error_mask) == 0;
  if (protocol_.status && (latest_.status & protocol_.status->overload_mask) != 0) latest_.saturated = true;
  latest_.repeats = same ? latest_.repeats + 1 : 0;
  watch_.add(numbers_);
  latest_.channel_repeats = watch_.repeats();
  latest_.time_ns = time_ns;
  latest_.late = !streams_ && begun_ns_ < poll_ns_;
  if (latest_.late) ++counts_.late;
  ++latest_.number;
  fresh_ = true;
  for (std::size_t row = 0; row < 6; ++row) {
    double sum = 0.0;
    for (std::size_t i = 0; i < channels_.size(); ++i) sum += channels_[i].column[row] * values_[i];
    latest_.wrench_S[row] = sum;
  }
}

}  // namespace proxarm::fieldbus
