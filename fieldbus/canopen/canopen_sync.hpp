// SYNC (CiA 301, 7.2.5): the frame on which all drives latch their targets and sample their positions together.
//
// Wire: identifier 080 without data, or with one byte for drives that use a counter. The counter runs from 1 to the
// overflow value of 1019h.
#pragma once

#include <cstdint>
#include <optional>

#include "fieldbus/can/can_frame.hpp"
#include "models/base/state_archive.hpp"

namespace proxarm::fieldbus {

inline constexpr std::uint32_t sync_id = 0x080;

class SyncProducer {
 public:
  // `counter_overflow` is the value of 1019h: 0 means no counter, else 2..240.
  explicit SyncProducer(std::uint8_t counter_overflow = 0) noexcept : overflow_(counter_overflow) {}
  [[nodiscard]] CanFrame next() noexcept;
  void archive(StateArchive& state) noexcept { state(counter_); }

 private:
  std::uint8_t overflow_;
  std::uint8_t counter_ = 0;
};

// Returns the period in the unit of 1006h, whole microseconds. Returns nullopt if the period isn't a whole number of
// microseconds, or doesn't fit in 1006h.
[[nodiscard]] std::optional<std::uint32_t> sync_period_us(std::int64_t period_ns) noexcept;

}  // namespace proxarm::fieldbus
