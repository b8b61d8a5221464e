// Measures the load of a simulated bus and the worst response time of each identifier. Both are compared with the
// predictions of bus_budget.hpp.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "fieldbus/can/can_frame.hpp"
#include "fieldbus/can/can_timing.hpp"

namespace proxarm::fieldbus {

struct IdentifierStatistics {
  std::uint32_t id = 0;
  bool extended = false;
  std::uint64_t frames = 0;
  // Fewest bits of a frame with this identifier: the sum over both bitrates, interframe space included.
  int least_bits = 0;
  // Most bits of a frame with this identifier, counted like least_bits.
  int most_bits = 0;
  // Longest time from the call of send() to the end of the frame, without the interframe space.
  std::int64_t worst_response_ns = 0;
};

class BusStatistics {
 public:
  explicit BusStatistics(std::int64_t window_ns);

  // Clears all counts. Measuring starts again at now_ns.
  void reset(std::int64_t now_ns) noexcept;
  // Adds a frame that occupies the bus in [start_ns, idle_ns). Precondition: frames are added in the order of their
  // times. Allocates only for a new identifier.
  void add_frame(const CanFrame& frame, WireBits bits, std::int64_t start_ns, std::int64_t idle_ns);
  void add_response(const CanFrame& frame, std::int64_t response_ns) noexcept;
  void add_collision() noexcept { ++collisions_; }

  [[nodiscard]] std::uint64_t frames() const noexcept { return frames_; }
  [[nodiscard]] std::uint64_t bits() const noexcept { return bits_; }
  [[nodiscard]] std::int64_t busy_ns(std::int64_t now_ns) const noexcept;
  // Returns the share of the time since reset() in which the bus was in use, 0..1.
  [[nodiscard]] double load(std::int64_t now_ns) const noexcept;
  // Returns the largest load (0..1) of all complete windows since reset(). Windows of window_ns follow each other
  // without overlap.
  [[nodiscard]] double peak_load() const noexcept;
  // Returns how often two nodes began to send the same identifier at the same moment, which is an error on a real bus.
  // The simulated bus sends the frame of the node that was attached first.
  [[nodiscard]] std::uint64_t collisions() const noexcept { return collisions_; }
  // Sorted by first appearance on the bus.
  [[nodiscard]] const std::vector<IdentifierStatistics>& identifiers() const noexcept { return identifiers_; }
  // Returns nullptr if the bus has carried no frame with this identifier.
  [[nodiscard]] const IdentifierStatistics* find(std::uint32_t id, bool extended = false) const noexcept;

 private:
  [[nodiscard]] IdentifierStatistics* entry(const CanFrame& frame) noexcept;
  void add_busy(std::int64_t from_ns, std::int64_t to_ns) noexcept;

  std::int64_t window_ns_;
  std::int64_t since_ns_ = 0;
  std::int64_t busy_ns_ = 0;  // includes the rest of a frame in progress
  std::int64_t busy_until_ns_ = 0;
  std::int64_t window_end_ns_ = 0;
  std::int64_t window_busy_ns_ = 0;
  std::int64_t peak_busy_ns_ = 0;
  std::uint64_t frames_ = 0;
  std::uint64_t bits_ = 0;
  std::uint64_t collisions_ = 0;
  std::vector<IdentifierStatistics> identifiers_;
  std::array<std::uint16_t, 2048> index_of_base_id_{};  // position in identifiers_ plus 1; 0: identifier not seen
};

}  // namespace proxarm::fieldbus
