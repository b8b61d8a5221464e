// Rules that inject faults into simulated buses at given times, identically in every run. SimulatedCanNetwork::apply()
// takes them.
//
// A rule either matches frames (by bus, identifier, time window and number of the occurrence) and says what happens to
// them, or makes a port fail, or adds a babbling node. If several rules match a frame, all of them apply to it.
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "fieldbus/can/can_frame.hpp"

namespace proxarm::fieldbus {

enum class FaultAction : std::uint8_t {
  drop,   // the frame takes its time on the bus, but no node receives it
  delay,  // the frame is received delay_ns late, possibly after frames that were sent later
  // The frame is received with the bits in `flips` inverted. (A real CRC very rarely misses such an error.)
  corrupt,
  resize,         // the frame is received with `length` data bytes, cut off or padded with zeros
  duplicate,      // the frame is sent twice in a row, as after an error in the last bit of a frame
  destroy,        // the frame ends in an error frame and is repeated, as with noise on a real bus
  bus_off,        // `port` is off the bus from from_ns to to_ns; its queue is purged
  port_down,      // `port`'s interface is down from from_ns to to_ns
  error_passive,  // `port` reports the state error passive from from_ns to to_ns; frames still pass
  babble,         // an extra node sends `frame` every period_ns, from from_ns to to_ns
};

// Names one bit of a frame's data. Bit 0 is the least significant bit of the byte.
struct BitFlip {
  std::uint8_t byte = 0;
  std::uint8_t bit = 0;
};

struct FaultRule {
  static constexpr std::int64_t forever = std::numeric_limits<std::int64_t>::max();

  FaultAction action = FaultAction::drop;
  std::string bus{};  // name of the bus; empty: all buses

  // A frame matches if (frame.id & mask) == (id & mask) and the frame starts in [from_ns, to_ns). Mask 0 matches every
  // identifier. The matching frames are counted from 1. The rule applies to `count` of them, from number `first` on.
  std::uint32_t id = 0;
  std::uint32_t mask = 0;
  std::int64_t from_ns = 0;
  std::int64_t to_ns = forever;
  std::uint64_t first = 1;
  std::uint64_t count = std::numeric_limits<std::uint64_t>::max();
  std::string receiver{};  // drop, delay, corrupt, resize: the port for which the rule applies; empty: all ports

  std::int64_t delay_ns = 0;       // used by delay
  std::vector<BitFlip> flips{};    // used by corrupt; flips of bytes past the frame's end have no effect
  std::uint8_t length = 0;         // used by resize; must be a valid length for the frame's format
  std::string port{"controller"};  // used by bus_off, port_down and error_passive
  CanFrame frame{};                // used by babble
  std::int64_t period_ns = 0;      // used by babble; must be > 0
};

struct FaultScript {
  std::vector<FaultRule> rules;
};

}  // namespace proxarm::fieldbus
