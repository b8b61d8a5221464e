#include "fieldbus/cia402/cia402_bring_up.hpp"

#include <algorithm>
#include <optional>

#include "fieldbus/cia402/drive_exchange.hpp"
#include "fieldbus/cia402/drive_start.hpp"
#include "models/base/setup_error.hpp"

namespace proxarm::fieldbus {
namespace {

using description::SetupError;
using description::SetupProblem;
using Slots = std::span<const DriveSlot>;

void refuse_shared_nodes(Slots drives) {
  for (auto a = drives.begin(); a != drives.end(); ++a) {
    for (auto b = std::next(a); b != drives.end(); ++b) {
      if (a->bus != b->bus || a->drive->node() != b->drive->node()) continue;
      throw SetupError(
          {.bus = b->drive->description().bus,
           .node = b->drive->node(),
           .message = "two drives have this node on one bus",
           .found = a->drive->description().joint + " and " + b->drive->description().joint,
           .expected = "one node number each",
           .advice =
               "set another node at one of the drives, or give each of the cell's buses an interface of its own"});
    }
  }
}

void throw_problems(Slots drives, const std::vector<SdoSequence>& sequences) {
  std::optional<SetupProblem> first;
  std::string others;
  for (std::size_t i = 0; i < sequences.size(); ++i) {
    if (!sequences[i].problem()) continue;
    if (!first) {
      first = sequences[i].problem();
    } else {
      others += others.empty() ? "also at fault: " : ", ";
      others += "bus " + drives[i].drive->description().bus + " node " + std::to_string(drives[i].drive->node());
    }
  }
  if (!first) return;
  for (const DriveSlot& slot : drives) {
    if (slot.drive->node() != first->node || slot.drive->emergencies() == 0) continue;
    if (slot.drive->description().bus != first->bus) continue;
    first->advice += (first->advice.empty() ? "" : "; ") + std::string("the drive also sent ") +
                     describe(slot.drive->latest_emergency());
  }
  if (!others.empty()) first->advice += (first->advice.empty() ? "" : "; ") + others;
  throw SetupError(*first);
}

void refuse_restart(const ServoDrive& drive, std::uint64_t boot_ups) {
  if (drive.boot_ups() == boot_ups) return;
  throw SetupError({.bus = drive.description().bus,
                    .node = drive.node(),
                    .message = "drive of " + drive.description().joint,
                    .found = "a restart while it was configured",
                    .expected = "a drive that stays on",
                    .advice = "look at its supply; is another master on the bus?"});
}

DriveIdentity identity_of(const SdoSequence& sequence) {
  const auto value = [&](std::uint16_t index, std::uint8_t sub) { return sequence.value_of({index, sub}).value_or(0); };
  return {value(0x1000, 0), value(0x1018, 1), value(0x1018, 2),  value(0x1018, 3),
          value(0x1018, 4), value(0x6502, 0), sequence.missing()};
}

// True if a drive refused to map optional feedback. The drive then gives up this feedback, and all drives must be
// configured again.
bool some_feedback_given_up(Slots drives, const std::vector<SdoSequence>& sequences) {
  bool given_up = false;
  for (std::size_t i = 0; i < sequences.size(); ++i) {
    if (!sequences[i].problem()) continue;
    if (drives[i].drive->give_up_feedback(sequences[i].failed_step(), sequences[i].failed_abort())) given_up = true;
  }
  return given_up;
}

// Runs one exchange with every drive, side by side. Returns nullopt if a drive gave up feedback; the exchange must then
// be repeated.
std::optional<std::vector<DriveIdentity>> try_to_configure(CanNetwork& network, Slots drives,
                                                           const FrameHandler& handler, const StepsOf& steps_of) {
  std::vector<std::uint64_t> boot_ups;
  const std::vector<SdoSequence> sequences = exchange(network, drives, handler, steps_of, &boot_ups);
  if (some_feedback_given_up(drives, sequences)) return std::nullopt;
  throw_problems(drives, sequences);
  for (std::size_t i = 0; i < drives.size(); ++i) refuse_restart(*drives[i].drive, boot_ups[i]);
  std::vector<DriveIdentity> identities;
  for (std::size_t i = 0; i < drives.size(); ++i) {
    identities.push_back(identity_of(sequences[i]));
    drives[i].drive->note_losses(sequences[i].losses());
  }
  return identities;
}

// Configures the drives until no drive gives up feedback. The loop ends because each repetition has less feedback than
// the one before.
std::vector<DriveIdentity> configure(CanNetwork& network, Slots drives, const FrameHandler& handler,
                                     const StepsOf& steps_of) {
  for (;;) {
    if (auto identities = try_to_configure(network, drives, handler, steps_of)) return *identities;
  }
}

void require_pre_operational(CanNetwork& network, Slots drives, const FrameHandler& handler) {
  const std::int64_t timeout_ns = longest_nmt_timeout_ns(drives);
  if (wait_for_state(network, drives, handler, NmtState::pre_operational, timeout_ns)) return;
  const auto other = std::find_if_not(drives.begin(), drives.end(), [](const DriveSlot& slot) {
    return slot.drive->nmt_state() == NmtState::pre_operational;
  });
  throw not_in_state(*other->drive, NmtState::pre_operational, "",
                     "it took its configuration but doesn't stay in pre-operational: is another master on the bus?");
}

}  // namespace

std::string describe(const DriveIdentity& identity) {
  std::string text = "device type " + hex_text(identity.device_type, 8) + ", vendor " + hex_text(identity.vendor, 8) +
                     ", product " + hex_text(identity.product, 8) + ", revision " + hex_text(identity.revision, 8) +
                     ", serial number " + std::to_string(identity.serial) + ", supported modes " +
                     hex_text(identity.supported_modes, 8);
  const char* separator = "; hasn't: ";
  for (const std::string& object : identity.missing) {
    text += separator + object;
    separator = ", ";
  }
  return text;
}

std::vector<std::string> losses_of(Slots drives) {
  std::vector<std::pair<std::string, std::vector<std::string>>> by_text;
  for (const DriveSlot& slot : drives) {
    for (const std::string& loss : slot.drive->losses()) {
      auto known = std::find_if(by_text.begin(), by_text.end(), [&](const auto& entry) { return entry.first == loss; });
      if (known == by_text.end()) known = by_text.insert(known, {loss, {}});
      known->second.push_back(slot.drive->description().joint);
    }
  }
  std::vector<std::string> lines;
  for (const auto& [loss, joints] : by_text) {
    std::string line = joints.size() == 1 ? "drive of " : "drives of ";
    for (const std::string& joint : joints) line += (&joint == &joints.front() ? "" : ", ") + joint;
    lines.push_back(line + ": " + loss);
  }
  return lines;
}

std::vector<DriveIdentity> bring_up_drives(CanNetwork& network, Slots drives, const FrameHandler& other,
                                           const Tell& tell) {
  refuse_shared_nodes(drives);
  const FrameHandler handler = handed_to(drives, other);
  const auto configure_all = [&](Slots some) {
    auto identities =
        configure(network, some, handler, [](const ServoDrive& drive) { return drive.configuration_steps(); });
    require_pre_operational(network, some, handler);
    return identities;
  };
  send_nmt(network, drives, NmtCommand::enter_pre_operational, "enter pre-operational");
  std::vector<DriveIdentity> identities = configure_all(drives);
  start_drives(
      network, drives, handler, [&](Slots some) { (void)configure_all(some); }, tell);
  (void)configure(network, drives, handler, [](const ServoDrive& drive) { return drive.operation_steps(); });
  for (const DriveSlot& slot : drives) slot.drive->start_cycle(network.now_ns());
  return identities;
}

bool is_switched_off(DriveState state) noexcept {
  switch (state) {
    case DriveState::switch_on_disabled:
    case DriveState::ready_to_switch_on:
    case DriveState::fault:
      return true;
    default:
      return false;
  }
}

}  // namespace proxarm::fieldbus
