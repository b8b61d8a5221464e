// Whether a CAN bus can carry a cycle: the arithmetic behind `proxarm plan` and behind refusing a timestep.
//
//   PlannedBus bus{.name = "axes_1_3", .frames = {
//       {.name = "SYNC", .id = 0x080, .sender = "controller", .sync = true},
//       {.name = "drive 1 TPDO1", .id = 0x181, .shape = {.bytes = 6}, .sender = "drive 1", .after = "SYNC"},
//       {.name = "drive 1 RPDO1", .id = 0x201, .shape = {.bytes = 6}, .sender = "controller", .release = 0.45}}};
//   BusPlan plan = plan_bus(bus, 1'000'000);       // plan.fits, plan.worst_load, plan.frames[1].response_ns ...
//   std::cout << plan_text(plan);
//
// Every frame is taken at its longest (can_timing.hpp). The worst response of a frame m is bounded by response-time
// analysis for non-preemptive fixed priorities (Tindell & Burns 1994; Davis, Burns, Bril & Lukkien 2007; first in,
// first out queues as Davis, Kollmann, Pollex & Slomka 2011), with offsets. m, released at r .. r + J in the cycle,
// begins at
//
//   b = s + B + sum C_k N_k(s, b)          the least solution; it is gone at b + C_m
//
// in the busy period that begins at s, and the worst s counts.
//   B       the longest weaker frame that can be on the wire at s: one, as none weaker starts while m waits
//   C_k N_k the wire time of those stronger frames, and of those before m in its sender's queue, that can be
//           released in [s, b]
// "Weaker" is weaker than the weakest frame that can stand before m in its queue. What can be pending when, and J of a
// frame that comes after another, depend on the others' results: all grow together until none changes. No run of the
// in-process bus may exceed it (a test holds it to that).
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "fieldbus/can/can_timing.hpp"

namespace proxarm::fieldbus {

// One frame of every cycle (or of every n-th).
struct PlannedFrame {
  std::string name;  // unique on its bus
  std::uint32_t id = 0;
  FrameShape shape{};
  std::string sender{};  // frames of one sender leave in the order in which they are queued

  // When it is queued: `release` (fraction of the period after the cycle's start) ..., or, with `after`, when that
  // frame has arrived; and delay_ns to latest_delay_ns after that. Of one sender's frames queued at the same time,
  // those that are listed first go first.
  double release = 0.0;
  std::string after{};
  std::int64_t delay_ns = 0;
  std::int64_t latest_delay_ns = 0;  // below delay_ns: the same as delay_ns
  bool any_time = false;             // queued at any moment, not in step with the cycle: heartbeats, SDO, emergencies
  int every_cycles = 1;              // once in so many cycles
  std::int64_t every_ns = 0;  // any_time: by a clock of its own, such as a sensor's that streams; 0: by every_cycles

  double deadline =
      1.0;            // latest end, as a fraction of the period after the cycle's start (any_time: after its queuing)
  bool sync = false;  // it is the SYNC

  std::vector<CanFrame> typical{};  // as it usually is, for the typical load; none: random data
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
  std::int64_t wire_ns = 0;      // its own longest time on the wire
  std::int64_t response_ns = 0;  // at worst, from being queued to its end
  std::int64_t finish_ns = 0;    // at worst, from the cycle's start (any_time: the same as response_ns)
  std::int64_t deadline_ns = 0;
  bool bounded = true;  // false: it can wait for more than a period, and the figures above say nothing
  [[nodiscard]] bool in_time() const noexcept { return bounded && finish_ns <= deadline_ns; }
};

struct BusPlan {
  std::string name;
  std::int64_t period_ns = 0;
  std::int64_t bitrate = 0;
  std::int64_t data_bitrate = 0;
  // Of one cycle in which every frame is due, interframe space included.
  int worst_bits = 0;
  int least_bits = 0;
  std::int64_t worst_ns = 0;
  std::int64_t least_ns = 0;
  double worst_load = 0.0;  // of that cycle, 1 = all of its time
  double least_load = 0.0;
  double mean_worst_load =
      0.0;                    // over many cycles: a frame of every n-th cycle counts 1/n; all frames at their longest
  double typical_load = 0.0;  // the same with frames as they usually are, stuff bits included
  std::int64_t sync_jitter_ns = 0;  // the SYNC can be held back by the longest other frame
  std::vector<FramePlan> frames;
  std::vector<std::string> outranking_sync;  // names of the frames that win over the SYNC
  bool fits = false;
  std::vector<std::string> reasons;       // why it doesn't fit, with the arithmetic
  std::vector<std::string> alternatives;  // what would fit instead
};

// Throws SetupError for what can't be planned: no such bitrate or length, period not above 0, two frames with the same
// identifier (but a frame may answer on the identifier of the one it comes after, as some sensors do), a name given
// twice, an `after` that doesn't exist or leads in a circle, a CAN FD frame on a classic bus.
[[nodiscard]] BusPlan plan_bus(const PlannedBus& bus, std::int64_t period_ns);

// A table for people, several lines, ending in a newline.
[[nodiscard]] std::string plan_text(const BusPlan& plan);

// For SetupError and --timestep: one line with what is needed, what there is, and what would fit. Empty if all fit.
[[nodiscard]] std::string refusal_text(const std::vector<BusPlan>& plans);

}  // namespace proxarm::fieldbus
