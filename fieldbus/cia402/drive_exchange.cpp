#include "fieldbus/cia402/drive_exchange.hpp"

#include <algorithm>
#include <limits>

namespace proxarm::fieldbus {
namespace {

using Slots = std::span<const DriveSlot>;

}  // namespace

FrameHandler handed_to(Slots drives, const FrameHandler& other) {
  return [drives, other](std::size_t bus, const TimedFrame& received) {
    for (const DriveSlot& slot : drives) {
      if (slot.bus == bus && slot.drive->on_frame(received.frame, received.time_ns)) return;
    }
    if (other) other(bus, received);
  };
}

std::vector<SdoSequence> exchange(CanNetwork& network, Slots drives, const FrameHandler& handler,
                                  const StepsOf& steps_of, std::vector<std::uint64_t>* boot_ups) {
  std::vector<SdoSequence> sequences;
  sequences.reserve(drives.size());
  for (const DriveSlot& slot : drives) {
    const ServoDrive& drive = *slot.drive;
    sequences.emplace_back(network.bus(slot.bus), drive.node(), drive.description().bus,
                           "drive of " + drive.description().joint, steps_of(drive), drive.settings().sdo);
  }
  for (SdoSequence& sequence : sequences) sequence.start(network.now_ns());
  std::vector<std::uint64_t> at_first_answer;
  for (const DriveSlot& slot : drives) at_first_answer.push_back(slot.drive->boot_ups());
  const FrameHandler on_frame = [&](std::size_t bus, const TimedFrame& received) {
    bool taken = false;
    for (std::size_t i = 0; i < sequences.size() && !taken; ++i) {
      if (drives[i].bus != bus) continue;
      const bool answered = sequences[i].answered();
      taken = sequences[i].on_frame(received.frame, received.time_ns);
      if (!answered && sequences[i].answered()) at_first_answer[i] = drives[i].drive->boot_ups();
    }
    if (!taken) handler(bus, received);
  };
  // The pump has no deadline, because each exchange has its own timeouts.
  constexpr std::int64_t forever = std::numeric_limits<std::int64_t>::max();
  pump_frames(network, forever, on_frame, [&](std::int64_t now_ns) {
    std::int64_t wake_ns = forever;
    bool done = true;
    for (SdoSequence& sequence : sequences) {
      sequence.poll(now_ns);
      if (sequence.finished()) continue;
      done = false;
      wake_ns = std::min(wake_ns, sequence.wake_ns(now_ns));
    }
    return done ? pump_done : wake_ns;
  });
  if (boot_ups != nullptr) *boot_ups = at_first_answer;
  return sequences;
}

void send_nmt(CanNetwork& network, Slots drives, NmtCommand command, const char* name) {
  for (const DriveSlot& slot : drives) {
    const SendResult result = network.bus(slot.bus).send(nmt_frame(command, slot.drive->node()));
    if (result == SendResult::sent) continue;
    const char* found = result == SendResult::queue_full ? "a full queue"
                        : result == SendResult::bus_off  ? "bus-off"
                        : result == SendResult::refused  ? "a frame that the interface can't carry"
                                                         : "an interface that is down";
    throw description::SetupError(
        {.bus = slot.drive->description().bus,
         .node = slot.drive->node(),
         .message = std::string("the NMT command ") + name + " could not be sent",
         .found = found,
         .advice = "is the interface up, and is another node on the bus to acknowledge frames?"});
  }
}

std::int64_t longest_nmt_timeout_ns(Slots drives) noexcept {
  std::int64_t longest_ns = 0;
  for (const DriveSlot& slot : drives) longest_ns = std::max(longest_ns, slot.drive->settings().nmt_timeout_ns);
  return longest_ns;
}

bool wait_for_state(CanNetwork& network, Slots drives, const FrameHandler& handler, NmtState state,
                    std::int64_t timeout_ns) {
  const std::int64_t deadline_ns = network.now_ns() + timeout_ns;
  return pump_frames(network, deadline_ns, handler, [&](std::int64_t) {
    const bool all = std::all_of(drives.begin(), drives.end(),
                                 [state](const DriveSlot& slot) { return slot.drive->nmt_state() == state; });
    return all ? pump_done : deadline_ns;
  });
}

description::SetupError not_in_state(const ServoDrive& drive, NmtState wanted, const std::string& more,
                                     const char* advice) {
  return description::SetupError({.bus = drive.description().bus,
                                  .node = drive.node(),
                                  .message = "drive of " + drive.description().joint + ", NMT state in its heartbeat",
                                  .found = std::string(to_string(drive.nmt_state())) + more,
                                  .expected = std::string(to_string(wanted)),
                                  .advice = advice});
}

}  // namespace proxarm::fieldbus
