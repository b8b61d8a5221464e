// Decides whether a CAN bus can carry a cycle's frames, for `proxarm plan` and for refusing a timestep.
//
//   PlannedBus bus{.name = "axes_1_3", .frames = {
//       {.name = "SYNC", .id = 0x080, .sender = "controller", .sync = true},
//       {.name = "drive 1 TPDO1", .id = 0x181, .shape = {.bytes = 6}, .sender = "drive 1", .after = "SYNC"},
//       {.name = "drive 1 RPDO1", .id = 0x201, .shape = {.bytes = 6}, .sender = "controller", .release = 0.45}}};
//   BusPlan plan = plan_bus(bus, 1'000'000);       // plan.fits, plan.worst_load, plan.frames[1].response_ns ...
//   std::cout << plan_text(plan);
//
// Every frame is assumed to have its maximum length (can_timing.hpp). The worst response time of a frame m is bounded
// by response-time analysis for non-preemptive fixed priorities (Tindell & Burns 1994; Davis, Burns, Bril & Lukkien
// 2007; first in, first out queues as in Davis, Kollmann, Pollex & Slomka 2011), with offsets:
// 1. Frame m is released at a time between r and r + J in the cycle (J is its release jitter).
// 2. A busy period that contains m begins at a time s.
// 3. B is the wire time of the longest lower-priority frame that can be on the wire at s. "Lower priority" means: lower
//    than the priority of every frame that can precede m in its sender's queue. B is a single frame, because no
//    lower-priority frame starts while m waits.
// 4. C_k is the longest wire time of a frame k. N_k(s, b) is how often frame k can be released in [s, b]. The sum is
//    over the frames k that have a higher priority than m, or that can precede m in its sender's queue.
// 5. m begins at the least solution b of
//
//   b = s + B + sum C_k N_k(s, b)
//
//   and ends at b + C_m. The largest end over all possible s is the bound.
// 6. If a frame comes after another frame, its release time and J depend on the other frame's bound. So all bounds are
//    increased together until no bound changes.
// A test checks that no run of the in-process bus exceeds these bounds.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "fieldbus/can/can_timing.hpp"

namespace proxarm::fieldbus {

// One frame that is sent in every cycle or in every n-th cycle.
struct PlannedFrame {
  std::string name;  // unique on its bus
  std::uint32_t id = 0;
  FrameShape shape{};
  std::string sender{};  // frames of one sender leave in the order in which they were queued

  // The frame is queued between delay_ns and latest_delay_ns after its release. Its release is `release`, or the
  // arrival of the frame `after` if `after` isn't empty. Frames that are queued at the same time leave in the order of
  // the list.
  double release = 0.0;  // fraction of the period after the cycle's start
  std::string after{};
  std::int64_t delay_ns = 0;
  std::int64_t latest_delay_ns = 0;  // if below delay_ns, delay_ns is used
  // The frame isn't in step with the cycle, like heartbeats, SDOs and emergencies.
  bool any_time = false;
  int every_cycles = 1;  // the frame is sent once in this many cycles
  // Used with any_time: the sender's clock sends the frame with this period, as in a streaming sensor; 0: every_cycles
  // is used.
  std::int64_t every_ns = 0;

  // Latest end of the frame as a fraction of the period: after the cycle's start, or after queuing with any_time.
  double deadline = 1.0;
  bool sync = false;

  // Frames with usual data, for the typical load; if empty, random data are used.
  std::vector<CanFrame> typical{};
};

struct PlannedBus {
  std::string name;
  std::int64_t bitrate = 1'000'000;
  std::int64_t data_bitrate = 0;  // bit/s of the CAN FD data phase; 0: the bus is classic
  std::vector<PlannedFrame> frames;
};

struct FramePlan {
  std::string name;
  std::uint32_t id = 0;
  bool extended = false;
  std::int64_t wire_ns = 0;      // the frame's longest time on the wire
  std::int64_t response_ns = 0;  // worst case, from queuing to the end of the frame
  // Worst case, from the cycle's start to the end of the frame; with any_time it equals response_ns.
  std::int64_t finish_ns = 0;
  std::int64_t deadline_ns = 0;
  // false: the frame can wait longer than its repetition time, and response_ns and finish_ns are meaningless.
  bool bounded = true;
  [[nodiscard]] bool in_time() const noexcept { return bounded && finish_ns <= deadline_ns; }
};

struct BusPlan {
  std::string name;
  std::int64_t period_ns = 0;
  std::int64_t bitrate = 0;
  std::int64_t data_bitrate = 0;
  // The next six members describe a cycle in which every frame is due, with interframe spaces. worst: all frames have
  // their maximum length; least: all have their minimum length.
  int worst_bits = 0;
  int least_bits = 0;
  std::int64_t worst_ns = 0;
  std::int64_t least_ns = 0;
  double worst_load = 0.0;  // share of the cycle's time, 1 = the whole cycle
  double least_load = 0.0;
  // Average load over many cycles; a frame that is sent in every n-th cycle counts 1/n. All frames have their maximum
  // length.
  double mean_worst_load = 0.0;
  double typical_load = 0.0;  // average load over many cycles with usual data, stuff bits included
  // How long another frame can delay the SYNC: the time of the longest other frame.
  std::int64_t sync_jitter_ns = 0;
  std::vector<FramePlan> frames;
  std::vector<std::string> outranking_sync;  // names of the frames whose priority is higher than that of the SYNC
  bool fits = false;
  std::vector<std::string> reasons;       // why the bus doesn't fit, with numbers
  std::vector<std::string> alternatives;  // changes with which the bus would fit
};

// Computes the plan of a bus. Throws SetupError if the bus can't be planned:
// - a bitrate or a length is invalid, or the period isn't above 0
// - two frames have the same identifier; a frame may only use the identifier of the frame that it comes after, as the
//   answers of some sensors do
// - a name is given twice
// - an `after` names no frame, or leads in a circle
// - a CAN FD frame is on a classic bus
[[nodiscard]] BusPlan plan_bus(const PlannedBus& bus, std::int64_t period_ns);

// Returns the plan as a table of several lines for the user.
[[nodiscard]] std::string plan_text(const BusPlan& plan);

// Returns one line that says what the frames need, what is available, and what would fit. Empty if all plans fit.
[[nodiscard]] std::string refusal_text(const std::vector<BusPlan>& plans);

}  // namespace proxarm::fieldbus
