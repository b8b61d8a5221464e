#include "fieldbus/can/bus_statistics.hpp"

#include <algorithm>

namespace proxarm::fieldbus {

BusStatistics::BusStatistics(std::int64_t window_ns) : window_ns_(std::max<std::int64_t>(window_ns, 1)) {
  identifiers_.reserve(64);
  reset(0);
}

void BusStatistics::reset(std::int64_t now_ns) noexcept {
  since_ns_ = now_ns;
  busy_ns_ = window_busy_ns_ = peak_busy_ns_ = 0;
  window_end_ns_ = now_ns + window_ns_;
  add_busy(now_ns, busy_until_ns_);  // counts the rest of a frame in progress
  frames_ = bits_ = collisions_ = 0;
  identifiers_.clear();
  index_of_base_id_.fill(0);
}

void BusStatistics::add_busy(std::int64_t from_ns, std::int64_t to_ns) noexcept {
  while (from_ns < to_ns) {
    if (from_ns >= window_end_ns_) {
      peak_busy_ns_ = std::max(peak_busy_ns_, window_busy_ns_);
      window_busy_ns_ = 0;
      window_end_ns_ += ((from_ns - window_end_ns_) / window_ns_ + 1) * window_ns_;
    }
    const std::int64_t part = std::min(to_ns, window_end_ns_) - from_ns;
    busy_ns_ += part;
    window_busy_ns_ += part;
    from_ns += part;
  }
}

void BusStatistics::add_frame(const CanFrame& frame, WireBits bits, std::int64_t start_ns, std::int64_t idle_ns) {
  ++frames_;
  bits_ += static_cast<std::uint64_t>(bits.total());
  busy_until_ns_ = idle_ns;
  add_busy(start_ns, idle_ns);

  IdentifierStatistics* statistics = entry(frame);
  if (statistics == nullptr) {
    if (!frame.extended) index_of_base_id_[frame.id & 0x7ff] = static_cast<std::uint16_t>(identifiers_.size() + 1);
    statistics = &identifiers_.emplace_back();
    statistics->id = frame.id;
    statistics->extended = frame.extended;
    statistics->least_bits = bits.total();
  }
  ++statistics->frames;
  statistics->least_bits = std::min(statistics->least_bits, bits.total());
  statistics->most_bits = std::max(statistics->most_bits, bits.total());
}

void BusStatistics::add_response(const CanFrame& frame, std::int64_t response_ns) noexcept {
  if (IdentifierStatistics* statistics = entry(frame)) {
    statistics->worst_response_ns = std::max(statistics->worst_response_ns, response_ns);
  }
}

std::int64_t BusStatistics::busy_ns(std::int64_t now_ns) const noexcept {
  return busy_ns_ - std::max<std::int64_t>(busy_until_ns_ - now_ns, 0);
}

double BusStatistics::load(std::int64_t now_ns) const noexcept {
  if (now_ns <= since_ns_) return 0.0;
  return static_cast<double>(busy_ns(now_ns)) / static_cast<double>(now_ns - since_ns_);
}

double BusStatistics::peak_load() const noexcept {
  return static_cast<double>(peak_busy_ns_) / static_cast<double>(window_ns_);
}

const IdentifierStatistics* BusStatistics::find(std::uint32_t id, bool extended) const noexcept {
  CanFrame frame;
  frame.id = id;
  frame.extended = extended;
  return const_cast<BusStatistics*>(this)->entry(frame);
}

IdentifierStatistics* BusStatistics::entry(const CanFrame& frame) noexcept {
  if (!frame.extended) {
    const std::uint16_t place = index_of_base_id_[frame.id & 0x7ff];
    return place == 0 ? nullptr : &identifiers_[place - 1u];
  }
  for (auto& statistics : identifiers_) {
    if (statistics.extended && statistics.id == frame.id) return &statistics;
  }
  return nullptr;
}

}  // namespace proxarm::fieldbus
