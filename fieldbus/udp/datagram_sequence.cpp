#include "fieldbus/udp/datagram_sequence.hpp"

namespace proxarm::fieldbus {
namespace {

std::uint32_t mask_of(const description::NumberField& number) noexcept {
  return number.bits >= 32 ? 0xFFFFFFFFU : (1U << number.bits) - 1U;
}

}  // namespace

std::uint32_t DatagramSequence::number_in(std::span<const std::uint8_t> datagram) const noexcept {
  std::uint64_t word = 0;
  const std::size_t count = counter_->bytes();
  for (std::size_t i = 0; i < count; ++i) {
    word = word << 8 | datagram[counter_->byte + (counter_->big_endian ? i : count - 1 - i)];
  }
  return static_cast<std::uint32_t>(word >> counter_->shift) & mask_of(*counter_);
}

bool DatagramSequence::accept(std::span<const std::uint8_t> datagram) noexcept {
  if (datagram.size() != bytes_) {
    ++counts_.wrong_lengths;
    return false;
  }
  if (!counter_) return true;
  const std::uint32_t mask = mask_of(*counter_), number = number_in(datagram);
  const std::uint32_t step = (number - last_) & mask;
  if (begun_ && step == 0) {
    ++counts_.repeated;
    went_back_ = false;
    return false;
  }
  const bool back = begun_ && step > mask / 2;
  const std::uint32_t step_from_refused = (number - refused_) & mask;
  const bool begins_anew = went_back_ && step_from_refused != 0 && step_from_refused <= mask / 2;
  if (back && !begins_anew) {
    ++(went_back_ && step_from_refused == 0 ? counts_.repeated : counts_.out_of_order);
    went_back_ = true;
    refused_ = number;
    return false;
  }
  if (begun_ && !back) counts_.lost += step - 1;
  begun_ = true;
  went_back_ = false;
  last_ = number;
  return true;
}

}  // namespace proxarm::fieldbus
