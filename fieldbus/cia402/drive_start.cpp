#include "fieldbus/cia402/drive_start.hpp"

#include <algorithm>

#include "fieldbus/canopen/canopen_sync.hpp"
#include "fieldbus/cia402/drive_exchange.hpp"

namespace proxarm::fieldbus {
namespace {

using Slots = std::span<const DriveSlot>;

// Times after which a drive counts as not started: after the first NMT start, and after each remedy. Drives report
// their state every 50 ms (1017h), so these times contain enough heartbeats.
constexpr std::int64_t looked_into_after_ns = 300'000'000, shows_within_ns = 200'000'000;
// How long the controller shows signs of life before NMT start: five heartbeats.
constexpr std::int64_t signs_of_life_ns = 100'000'000;

constexpr const char* how_to_start =
    "it took its configuration but doesn't start: look at its display or its error list (1003h)";

struct HeldBack {
  DriveSlot slot;
  Emergency error;
};

struct Start {
  CanNetwork& network;
  const FrameHandler& handler;
  const ConfigureAnew& configure_anew;
  const Tell& tell;
};

bool is_started(const DriveSlot& slot) noexcept { return slot.drive->nmt_state() == NmtState::operational; }

std::string name_of(const DriveSlot& slot) {
  const description::DriveDescription& drive = slot.drive->description();
  return "drive of " + drive.joint + " (bus " + drive.bus + ", node " + std::to_string(drive.node) + ")";
}

// Returns the error as text. Some stacks write the end of an error (code 0) to 1003h:01 while another error persists,
// so the code may be 0.
std::string text_of(const Emergency& error) {
  if (error.code != 0) return describe(error);
  return "an error (1001h:00 is " + hex_text(error.error_register, 2) + ")";
}

std::vector<DriveSlot> slots_of(const std::vector<HeldBack>& held) {
  std::vector<DriveSlot> slots;
  for (const HeldBack& drive : held) slots.push_back(drive.slot);
  return slots;
}

// Returns the drives that haven't started and whose error register isn't 0.
std::vector<HeldBack> held_back(const Start& start, Slots drives) {
  std::vector<DriveSlot> waiting;
  std::copy_if(drives.begin(), drives.end(), std::back_inserter(waiting), std::not_fn(is_started));
  const auto answers = exchange(start.network, waiting, start.handler, [](const ServoDrive&) {
    return std::vector<SdoStep>{sdo_read({0x1001, 0}, 1, "error register"),
                                if_present(sdo_read({0x1003, 1}, 4, "latest error"))};
  });
  std::vector<HeldBack> held;
  for (std::size_t i = 0; i < waiting.size(); ++i) {
    const std::uint32_t bits = answers[i].value_of({0x1001, 0}).value_or(0);
    if (bits == 0 || is_started(waiting[i])) continue;
    Emergency error;
    error.code = static_cast<std::uint16_t>(answers[i].value_of({0x1003, 1}).value_or(0));
    error.error_register = static_cast<std::uint8_t>(bits);
    held.push_back({waiting[i], error});
  }
  return held;
}

void start_anew(const Start& start, Slots drives) {
  send_nmt(start.network, drives, NmtCommand::start, "start");
  (void)wait_for_state(start.network, drives, start.handler, NmtState::operational, shows_within_ns);
}

// ---- Remedies. If a drive refuses a step of a remedy, that isn't an error: the next remedy follows.

void reset_fault(const Start& start, Slots drives) {
  (void)exchange(start.network, drives, start.handler, [](const ServoDrive& drive) {
    const ObjectAddress word = object_address(drive.description().objects.controlword);
    return std::vector<SdoStep>{sdo_write(word, 2, 0x0000, "controlword"), sdo_write(word, 2, 0x0080, "controlword"),
                                sdo_write(word, 2, 0x0000, "controlword")};
  });
  start_anew(start, drives);
}

// Sends SYNC and the controller's heartbeat on the drives' buses, and then NMT start. Ends when all drives are
// operational or the time is up.
void start_under_signs_of_life(const Start& start, Slots drives) {
  const DriveSettings& settings = drives.front().drive->settings();
  HeartbeatProducer heartbeat(settings.master_node, std::int64_t{settings.master_heartbeat_ms} * 1'000'000);
  SyncProducer sync;
  const std::int64_t begun_ns = start.network.now_ns();
  std::int64_t next_ns = begun_ns;
  std::uint64_t cycle = 0;
  bool commanded = false;
  const auto to_all_buses = [&](const CanFrame& frame) {
    std::vector<std::size_t> told;
    for (const DriveSlot& slot : drives) {
      if (std::find(told.begin(), told.end(), slot.bus) != told.end()) continue;
      (void)start.network.bus(slot.bus).send(frame);
      told.push_back(slot.bus);
    }
  };
  pump_frames(start.network, begun_ns + signs_of_life_ns + shows_within_ns, start.handler, [&](std::int64_t now_ns) {
    if (now_ns >= next_ns) {
      CanFrame frame;
      to_all_buses(sync.next());
      if (heartbeat.due(now_ns, ++cycle, frame)) to_all_buses(frame);
      next_ns += settings.period_ns;
    }
    if (!commanded && now_ns - begun_ns >= signs_of_life_ns) {
      send_nmt(start.network, drives, NmtCommand::start, "start");
      commanded = true;
    }
    return std::all_of(drives.begin(), drives.end(), is_started) ? pump_done : next_ns;
  });
}

void show_life(const Start& start, Slots drives) {
  constexpr ObjectAddress sync_period{0x1006, 0}, consumer{0x1016, 1};
  (void)exchange(start.network, drives, start.handler, [=](const ServoDrive&) {
    return std::vector<SdoStep>{sdo_write(sync_period, 4, 0, "communication cycle period")};
  });
  start_under_signs_of_life(start, drives);
  (void)exchange(start.network, drives, start.handler, [=](const ServoDrive& drive) {
    return std::vector<SdoStep>{
        sdo_write(consumer, 4, 0, "consumer heartbeat time"),
        sdo_write(consumer, 4, drive.settings().consumer_heartbeat(), "consumer heartbeat time")};
  });
  for (const DriveSlot& slot : drives) {
    if (!is_started(slot)) continue;
    slot.drive->note_losses(
        {"1006h:00 stays 0 in this session, since it held an error from the one before: it doesn't "
         "watch SYNC; heartbeat and setpoint timer stop it"});
  }
}

void reset_communication(const Start& start, Slots drives) {
  std::vector<std::uint64_t> boot_ups;
  for (const DriveSlot& slot : drives) boot_ups.push_back(slot.drive->boot_ups());
  send_nmt(start.network, drives, NmtCommand::reset_communication, "reset communication");
  const std::int64_t deadline_ns = start.network.now_ns() + longest_nmt_timeout_ns(drives);
  pump_frames(start.network, deadline_ns, start.handler, [&](std::int64_t) {
    bool all = true;
    for (std::size_t i = 0; i < drives.size(); ++i) all = all && drives[i].drive->boot_ups() != boot_ups[i];
    return all ? pump_done : deadline_ns;
  });
  start.configure_anew(drives);
  start_anew(start, drives);
}

struct Means {
  const char* name;
  void (*apply)(const Start& start, Slots drives);
};
constexpr Means means[] = {{"a fault reset", reset_fault},
                           {"SYNC and heartbeat before NMT start", show_life},
                           {"NMT reset communication (82h)", reset_communication}};

// Applies the remedies in turn and removes the drives that have started from `held`. Returns the names of the remedies
// tried, for the error message.
std::string help(const Start& start, std::vector<HeldBack>& held) {
  std::string tried;
  for (const HeldBack& drive : held) {
    start.tell(name_of(drive.slot) + " holds " + text_of(drive.error) +
               " from before this session, and refuses NMT start");
  }
  for (const Means& mean : means) {
    if (held.empty()) break;
    mean.apply(start, slots_of(held));
    for (const HeldBack& drive : held) {
      start.tell(name_of(drive.slot) + ": " + (is_started(drive.slot) ? "started" : "not started") + " after " +
                 mean.name);
    }
    std::erase_if(held, [](const HeldBack& drive) { return is_started(drive.slot); });
    tried += (tried.empty() ? "" : ", ") + std::string(mean.name);
  }
  return tried;
}

}  // namespace

void start_drives(CanNetwork& network, Slots drives, const FrameHandler& handler, const ConfigureAnew& configure_anew,
                  const Tell& tell) {
  const Tell told = tell ? tell : [](const std::string&) {};
  const Start start{network, handler, configure_anew, told};
  const std::int64_t timeout_ns = longest_nmt_timeout_ns(drives);
  send_nmt(network, drives, NmtCommand::start, "start");
  const std::int64_t deadline_ns = network.now_ns() + timeout_ns;
  if (wait_for_state(network, drives, handler, NmtState::operational, std::min(timeout_ns, looked_into_after_ns)))
    return;
  std::vector<HeldBack> held = held_back(start, drives);
  const std::string tried = help(start, held);
  const std::int64_t left_ns = held.empty() ? std::max<std::int64_t>(deadline_ns - network.now_ns(), 0) : 0;
  if (wait_for_state(network, drives, handler, NmtState::operational, left_ns)) return;
  const DriveSlot& slot =
      held.empty() ? *std::find_if_not(drives.begin(), drives.end(), is_started) : held.front().slot;
  throw not_in_state(*slot.drive, NmtState::operational,
                     held.empty() ? "" : ", holding " + text_of(held.front().error) + " after " + tried, how_to_start);
}

}  // namespace proxarm::fieldbus
