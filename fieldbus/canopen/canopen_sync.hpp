// SYNC (CiA 301, 7.2.5): the frame on which all drives latch their targets and sample their positions together.
//
// Wire: identifier 080, no data; or one byte, a counter from 1 to the overflow value of 1019h, for drives that use it.
#pragma once

#include <cstdint>
#include <optional>

#include "fieldbus/can/can_frame.hpp"
#include "models/base/state_archive.hpp"

namespace proxarm::fieldbus {

inline constexpr std::uint32_t sync_id = 0x080;

class SyncProducer {
 public:
  // `counter_overflow` as in 1019h: 0 means no counter, else 2..240.
  explicit SyncProducer(std::uint8_t counter_overflow = 0) noexcept : overflow_(counter_overflow) {}
  [[nodiscard]] CanFrame next() noexcept;
  void archive(StateArchive& state) noexcept { state(counter_); }

 private:
  std::uint8_t overflow_;
  std::uint8_t counter_ = 0;
};

// 1006h holds whole microseconds; nullopt if the period isn't whole, or doesn't fit.
[[nodiscard]] std::optional<std::uint32_t> sync_period_us(std::int64_t period_ns) noexcept;

}  // namespace proxarm::fieldbus
