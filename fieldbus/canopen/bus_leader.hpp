// Listens whether another controller already leads a bus. Every command that sends on a bus does this first.
//
// Signs of a leader are frames that only a leader sends: SYNC (080), NMT commands (000), the heartbeat of the
// controller's node, and for the nodes to be led setpoints (RPDO 1 to 4: 200, 300, 400, 500 + node) and SDO requests
// (600 + node), which alone show a controller at its set-up. Frames that drives and sensors send by themselves are no
// sign. Two controllers that begin at the same moment detect each other only in their first cycles
// (Fault::second_master).
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "fieldbus/can/frame_pump.hpp"

namespace proxarm::fieldbus {

// Longer than the longest SYNC period (255 ms) and than a controller's longest pause at its set-up.
inline constexpr std::int64_t listen_before_speaking_ns = 300'000'000;

enum class Listening : std::uint8_t {
  for_leader,  // SYNC, NMT, the controller's heartbeat; setpoints and SDO requests for the nodes
  for_nodes,   // frames sent by the nodes: PDOs, EMCYs, SDO answers, heartbeats
};

struct BusToLead {
  std::size_t bus = 0;
  std::vector<std::uint8_t> nodes{};  // nodes to be led; empty: only SYNC and NMT are signs
  std::uint8_t master_node = 0;       // node of the controller's heartbeat; 0: heartbeats are ignored
};

// Counts the signs of a leader, or of nodes, on one bus.
class LeaderWatch {
 public:
  explicit LeaderWatch(BusToLead bus, Listening listening = Listening::for_leader);

  // For the kernel's filters.
  [[nodiscard]] std::vector<std::uint32_t> wanted_ids() const;
  void on_frame(const CanFrame& frame);
  [[nodiscard]] bool seen() const noexcept { return !counts_.empty(); }
  // "SYNC (0x080), 300 times; setpoints (0x201), 300 times"
  [[nodiscard]] std::string signs() const;

 private:
  BusToLead bus_;
  Listening listening_;
  std::map<std::uint32_t, std::uint64_t> counts_;  // by identifier
};

// Listens for `time_ns`, sending nothing; throws SetupError if another controller leads one of the buses. Every frame
// also goes to `other`.
void require_nobody_leads(CanNetwork& network, std::span<const BusToLead> buses,
                          std::int64_t time_ns = listen_before_speaking_ns, const FrameHandler& other = {});
// The same before a simulation sends as the nodes of a bus: throws if one of them already sends. Silent nodes aren't
// detected.
void require_nobody_plays(CanNetwork& network, std::span<const BusToLead> buses,
                          std::int64_t time_ns = listen_before_speaking_ns);

}  // namespace proxarm::fieldbus
