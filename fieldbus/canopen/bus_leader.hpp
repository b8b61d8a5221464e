// Finds out by listening whether another controller already leads a bus. Every command that sends on a bus listens
// first.
//
// Signs of a leader are frames that only a leader sends:
// - SYNC (080) and NMT commands (000)
// - the heartbeat of the controller's node
// - for each node to be led: setpoints (RPDO 1 to 4: 200, 300, 400, 500 + node)
// - for each node to be led: SDO requests (600 + node); during a controller's set-up these are the only sign
// Frames that drives and sensors send by themselves are no sign. If two controllers begin at the same moment, each
// detects the other only in its first cycles (Fault::second_master).
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "fieldbus/can/frame_pump.hpp"

namespace proxarm::fieldbus {

// How long to listen. This is longer than the longest SYNC period (255 ms) and longer than a controller's longest pause
// during its set-up.
inline constexpr std::int64_t listen_before_speaking_ns = 300'000'000;

enum class Listening : std::uint8_t {
  // Frames that only a leader sends: SYNC, NMT commands, the controller's heartbeat, and setpoints and SDO requests for
  // the nodes.
  for_leader,
  // Frames that the nodes send: PDOs, EMCYs, SDO answers, heartbeats.
  for_nodes,
};

struct BusToLead {
  std::size_t bus = 0;
  // Nodes to be led; if empty, only SYNC, NMT commands and the controller's heartbeat are signs.
  std::vector<std::uint8_t> nodes{};
  std::uint8_t master_node = 0;  // node number in the controller's heartbeat; 0: heartbeats are no sign
};

// Counts the signs on one bus: the signs of a leader or of nodes, as `listening` says.
class LeaderWatch {
 public:
  explicit LeaderWatch(BusToLead bus, Listening listening = Listening::for_leader);

  // Returns the identifiers that the kernel's filters must let pass.
  [[nodiscard]] std::vector<std::uint32_t> wanted_ids() const;
  void on_frame(const CanFrame& frame);
  [[nodiscard]] bool seen() const noexcept { return !counts_.empty(); }
  // Returns the signs as text, such as "SYNC (0x080), 300 times; setpoints (0x201), 300 times".
  [[nodiscard]] std::string signs() const;

 private:
  BusToLead bus_;
  Listening listening_;
  std::map<std::uint32_t, std::uint64_t> counts_;  // number of frames by identifier
};

// Listens for `time_ns` without sending. Throws SetupError if another controller leads one of the buses. `other` also
// gets every received frame.
void require_nobody_leads(CanNetwork& network, std::span<const BusToLead> buses,
                          std::int64_t time_ns = listen_before_speaking_ns, const FrameHandler& other = {});
// Listens for `time_ns` without sending, before a simulation plays the nodes of a bus. Throws SetupError if one of
// these nodes already sends. A silent node isn't detected.
void require_nobody_plays(CanNetwork& network, std::span<const BusToLead> buses,
                          std::int64_t time_ns = listen_before_speaking_ns);

}  // namespace proxarm::fieldbus
