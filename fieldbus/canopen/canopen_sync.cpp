#include "fieldbus/canopen/canopen_sync.hpp"

#include <limits>

namespace proxarm::fieldbus {

CanFrame SyncProducer::next() noexcept {
  CanFrame frame;
  frame.id = sync_id;
  if (overflow_ != 0) {
    counter_ = counter_ >= overflow_ ? std::uint8_t{1} : static_cast<std::uint8_t>(counter_ + 1);
    frame.length = 1;
    frame.data[0] = counter_;
  }
  return frame;
}

std::optional<std::uint32_t> sync_period_us(std::int64_t period_ns) noexcept {
  if (period_ns <= 0 || period_ns % 1000 != 0) return std::nullopt;
  const std::int64_t period_us = period_ns / 1000;
  if (period_us > std::numeric_limits<std::uint32_t>::max()) return std::nullopt;
  return static_cast<std::uint32_t>(period_us);
}

}  // namespace proxarm::fieldbus
