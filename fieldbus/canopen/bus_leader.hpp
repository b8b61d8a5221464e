// Listen, then speak: whether somebody leads a bus already. Every command that sends on a bus asks this first.
//
// A leader shows by what only a leader sends: SYNC (080), NMT commands (000), the heartbeat of the controller's own
// node, setpoints (RPDO 1 to 4: 200, 300, 400, 500 + node) and SDO requests (600 + node) for the nodes that are to be
// led. The last ones are all that shows of a controller that is still at its set-up. What drives and sensors say by
// themselves is no sign. Two that begin in the same moment both hear nothing: the first cycles tell
// (Fault::second_master).
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "fieldbus/can/frame_pump.hpp"

namespace proxarm::fieldbus {

// Longer than the longest SYNC period (255 ms) and than a controller's longest silence at its set-up.
inline constexpr std::int64_t listen_before_speaking_ns = 300'000'000;

// What to listen for on a bus.
enum class Listening : std::uint8_t {
  for_leader,  // SYNC, NMT, the controller's heartbeat; setpoints and SDO requests for the nodes
  for_nodes,   // what the nodes themselves send: PDOs, EMCYs, SDO answers, heartbeats
};

// What to listen to on one bus of the network.
struct BusToLead {
  std::size_t bus = 0;
  std::vector<std::uint8_t> nodes{};  // that are to be led; none: SYNC and NMT alone are signs
  std::uint8_t master_node = 0;       // whose heartbeat would be somebody else's; 0: not looked at
};

// The signs of a leader, or of nodes, on one bus.
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

// Listens for `time_ns`, to its end, and throws SetupError where somebody leads one of the buses. Sends nothing. Every
// frame goes to `other`, too.
void require_nobody_leads(CanNetwork& network, std::span<const BusToLead> buses,
                          std::int64_t time_ns = listen_before_speaking_ns, const FrameHandler& other = {});
// The same for who is about to play the nodes of a bus: throws where one of them speaks already. A node that has
// nothing to say in that time isn't heard.
void require_nobody_plays(CanNetwork& network, std::span<const BusToLead> buses,
                          std::int64_t time_ns = listen_before_speaking_ns);

}  // namespace proxarm::fieldbus
