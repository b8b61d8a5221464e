// Decides whether a CAN bus can carry a cycle's frames, for `proxarm plan` and for refusing a timestep.
//
//   PlannedBus bus{.name = "axes_1_3", .frames = {
//       {.name = "SYNC", .id = 0x080, .sender = "controller", .sync = true},
//       {.name = "drive 1 TPDO1", .id = 0x181, .shape = {.bytes = 6}, .sender = "drive 1", .after = "SYNC"},
//       {.name = "drive 1 RPDO1", .id = 0x201, .shape = {.bytes = 6}, .sender = "controller", .release = 0.45}}};
//   BusPlan plan = plan_bus(bus, 1'000'000);       // plan.fits, plan.worst_load, plan.frames[1].response_ns ...
//   std::cout << plan_text(plan);
//
// Every frame is assumed at its maximum length (can_timing.hpp). The worst response of a frame m is bounded by
// response-time analysis for non-preemptive fixed priorities (Tindell & Burns 1994; Davis, Burns, Bril & Lukkien 2007;
// first in, first out queues as in Davis, Kollmann, Pollex & Slomka 2011), with offsets. Frame m, released at r .. r +
// J in the cycle, begins at
//
//   b = s + B + sum C_k N_k(s, b)          the least solution; m ends at b + C_m
//
// in the busy period that begins at s. The worst s is taken.
//   B       the longest lower-priority frame that can be on the wire at s: one, as none starts while m waits
//   C_k N_k the wire time of the frames that can be released in [s, b] and have a higher priority than m or precede
//           m in its sender's queue
// "Lower priority" means lower than that of every frame that can precede m in its queue. Release times, and J of a
// frame that comes after another, depend on the other frames' results: all are increased together until none changes. A
// test checks that no run of the in-process bus exceeds these bounds.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "fieldbus/can/can_timing.hpp"

namespace proxarm::fieldbus {

// One frame of every cycle, or of every n-th.
struct PlannedFrame {
  std::string name;  // unique on its bus
  std::uint32_t id = 0;
  FrameShape shape{};
  std::string sender{};  // a sender's frames leave in the order of queuing

  // Queued at `release` (fraction of the period after the cycle's start) or, with `after`, when that frame has arrived;
  // plus delay_ns to latest_delay_ns. Frames queued at the same time leave in the order of the list.
  double release = 0.0;
  std::string after{};
  std::int64_t delay_ns = 0;
  std::int64_t latest_delay_ns = 0;  // below delay_ns: the same as delay_ns
  bool any_time = false;             // not in step with the cycle: heartbeats, SDO, emergencies
  int every_cycles = 1;              // sent once in this many cycles
  std::int64_t every_ns = 0;  // any_time: by the sender's clock, as a streaming sensor does; 0: every_cycles counts

  double deadline = 1.0;  // latest end, fraction of the period after the cycle's start (any_time: after queuing)
  bool sync = false;

  std::vector<CanFrame> typical{};  // examples of its usual data, for the typical load; empty: random data
};

struct PlannedBus {
  std::string name;
  std::int64_t bitrate = 1'000'000;
  std::int64_t data_bitrate = 0;  // CAN FD; 0: classic
  std::vector<PlannedFrame> frames;
};

struct FramePlan {
  std::string name;
  std::uint32_t id = 0;
  bool extended = false;
  std::int64_t wire_ns = 0;      // its longest time on the wire
  std::int64_t response_ns = 0;  // worst case, from queuing to the end of the frame
  std::int64_t finish_ns = 0;    // worst case, from the cycle's start (any_time: response_ns)
  std::int64_t deadline_ns = 0;
  bool bounded = true;  // false: it can wait longer than a period, and the figures above are meaningless
  [[nodiscard]] bool in_time() const noexcept { return bounded && finish_ns <= deadline_ns; }
};

struct BusPlan {
  std::string name;
  std::int64_t period_ns = 0;
  std::int64_t bitrate = 0;
  std::int64_t data_bitrate = 0;
  // For a cycle in which every frame is due, interframe space included.
  int worst_bits = 0;
  int least_bits = 0;
  std::int64_t worst_ns = 0;
  std::int64_t least_ns = 0;
  double worst_load = 0.0;  // of that cycle, 1 = all of its time
  double least_load = 0.0;
  double mean_worst_load = 0.0;     // average over many cycles (every n-th: 1/n), frames at maximum length
  double typical_load = 0.0;        // the same with usual data, stuff bits included
  std::int64_t sync_jitter_ns = 0;  // the longest other frame, which can hold the SYNC back
  std::vector<FramePlan> frames;
  std::vector<std::string> outranking_sync;  // frames with a higher priority than the SYNC
  bool fits = false;
  std::vector<std::string> reasons;       // why it doesn't fit, with figures
  std::vector<std::string> alternatives;  // changes with which it would fit
};

// Throws SetupError if the bus can't be planned: invalid bitrate or length, period not above 0, two frames with the
// same identifier (a frame may answer on the identifier of the one it comes after, as some sensors do), a name given
// twice, an `after` that doesn't exist or leads in a circle, a CAN FD frame on a classic bus.
[[nodiscard]] BusPlan plan_bus(const PlannedBus& bus, std::int64_t period_ns);

// A table of several lines for the user.
[[nodiscard]] std::string plan_text(const BusPlan& plan);

// One line with what is needed, what is available and what would fit. Empty if all fit.
[[nodiscard]] std::string refusal_text(const std::vector<BusPlan>& plans);

}  // namespace proxarm::fieldbus
