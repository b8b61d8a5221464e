// Rules that inject faults into simulated buses at given times, the same in every run.
//
// A rule matches frames (bus, identifier, time window, nth occurrence) and says what happens to them, or it makes a
// port fail, or adds a babbling node. All rules that match a frame apply to it. For SimulatedCanNetwork::apply().
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "fieldbus/can/can_frame.hpp"

namespace proxarm::fieldbus {

enum class FaultAction : std::uint8_t {
  drop,           // takes its time on the bus, but no node receives it
  delay,          // received delay_ns late, possibly after its successors
  corrupt,        // received with the bits in `flips` inverted (a real CRC misses such errors very rarely)
  resize,         // received with `length` data bytes, cut off or padded with zeros
  duplicate,      // sent twice in a row, as after an error in the last bit of a frame
  destroy,        // ends in an error frame and is repeated, as with noise on a real bus
  bus_off,        // `port` is off the bus from from_ns to to_ns; its queue is purged
  port_down,      // `port`'s interface is down from from_ns to to_ns
  error_passive,  // `port` reports that state from from_ns to to_ns; frames still pass
  babble,         // an extra node sends `frame` every period_ns, from from_ns to to_ns
};

// Bit 0 is the least significant bit of the byte.
struct BitFlip {
  std::uint8_t byte = 0;
  std::uint8_t bit = 0;
};

struct FaultRule {
  static constexpr std::int64_t forever = std::numeric_limits<std::int64_t>::max();

  FaultAction action = FaultAction::drop;
  std::string bus{};  // name; empty: all buses

  // Frames that match: (frame.id & mask) == (id & mask), so mask 0 matches all; start in [from_ns, to_ns). Of these,
  // counted from 1, `count` frames from number `first` on.
  std::uint32_t id = 0;
  std::uint32_t mask = 0;
  std::int64_t from_ns = 0;
  std::int64_t to_ns = forever;
  std::uint64_t first = 1;
  std::uint64_t count = std::numeric_limits<std::uint64_t>::max();
  std::string receiver{};  // drop, delay, corrupt, resize: only for this port; empty: for all

  std::int64_t delay_ns = 0;       // delay
  std::vector<BitFlip> flips{};    // corrupt; bytes past the frame's end stay unchanged
  std::uint8_t length = 0;         // resize; a length that the frame's format has
  std::string port{"controller"};  // bus_off, port_down, error_passive
  CanFrame frame{};                // babble
  std::int64_t period_ns = 0;      // babble, > 0
};

struct FaultScript {
  std::vector<FaultRule> rules;
};

}  // namespace proxarm::fieldbus
