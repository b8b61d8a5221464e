#include "fieldbus/cia402/cia402_goodbye.hpp"

#include <algorithm>

#include "fieldbus/can/byte_order.hpp"
#include "fieldbus/canopen/canopen_nmt.hpp"
#include "fieldbus/canopen/canopen_sdo.hpp"

namespace proxarm::fieldbus {
namespace {

struct Watched {
  ObjectAddress object;
  std::uint8_t bytes;
};
constexpr std::uint8_t watched_objects = 2;

// Returns the object whose watch is switched off in this step. The watch for the controller comes before that for SYNC,
// because more drives trip on a missing controller than on a missing SYNC.
Watched watched_by(const ServoDrive& drive, std::uint8_t step) noexcept {
  if (step > 0) return {{0x1006, 0}, 4};
  const bool guards = drive.description().bring_up.stops_by == description::StopsBy::life_guarding;
  return guards ? Watched{{0x100C, 0}, 2} : Watched{{0x1016, 1}, 4};
}

constexpr std::int64_t ms = 1'000'000;
// How long a drive may take from ready to switch on (no power) to switch on disabled. Most drives take two periods. A
// drive that is still ready to switch on after this time gets its requests in that state.
constexpr std::int64_t patience_ns = 100 * ms;
// Timeout for each answer. Drives answer within some milliseconds. If a frame is lost, waiting longer is of no use.
constexpr std::int64_t answer_timeout_ns = 50 * ms;
// Time limit for the goodbye to all drives. Six drives on one bus take about 30 ms.
constexpr std::int64_t limit_ns = 300 * ms;

}  // namespace

Goodbye::Goodbye(std::span<const DriveSlot> drives) : drives_(drives.begin(), drives.end()), nodes_(drives.size()) {}

void Goodbye::begin(std::int64_t now_ns) noexcept {
  begun_ns_ = now_ns;
  std::fill(nodes_.begin(), nodes_.end(), Node());
}

bool Goodbye::is_off(const ServoDrive& drive, std::int64_t now_ns) const noexcept {
  if (drive.state() == DriveState::ready_to_switch_on) return now_ns - begun_ns_ >= patience_ns;
  return is_switched_off(drive.state());
}

bool Goodbye::is_busy(std::size_t bus) const noexcept {
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    if (drives_[i].bus == bus && nodes_[i].waiting) return true;
  }
  return false;
}

bool Goodbye::next_request(std::int64_t now_ns, std::size_t& bus, CanFrame& frame) noexcept {
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    Node& node = nodes_[i];
    if (node.waiting && now_ns >= node.deadline_ns) {
      node.waiting = false;
      ++node.step;
    }
    const ServoDrive& drive = *drives_[i].drive;
    if (node.step >= watched_objects || is_busy(drives_[i].bus) || !is_off(drive, now_ns)) continue;
    bus = drives_[i].bus;
    const Watched watched = watched_by(drive, node.step);
    frame = expedited_download(drive.node(), watched.object, watched.bytes, 0);
    node.waiting = true;
    node.deadline_ns = now_ns + answer_timeout_ns;
    return true;
  }
  return false;
}

// A confirmation and an abort both end the step.
bool Goodbye::on_frame(std::size_t bus, const CanFrame& frame) noexcept {
  if (frame.extended || frame.remote || frame.error) return false;
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    if (drives_[i].bus != bus || frame.id != SdoClient::answer_id(drives_[i].drive->node())) continue;
    Node& node = nodes_[i];
    if (node.waiting && frame.length == 8 && names_object(frame, watched_by(*drives_[i].drive, node.step).object)) {
      node.waiting = false;
      ++node.step;
    }
    return true;
  }
  return false;
}

bool Goodbye::done(std::int64_t now_ns) const noexcept {
  return now_ns - begun_ns_ >= limit_ns ||
         std::all_of(nodes_.begin(), nodes_.end(), [](const Node& node) { return node.step >= watched_objects; });
}

void leave_operational(CanNetwork& network, std::span<const DriveSlot> drives) noexcept {
  for (const DriveSlot& slot : drives) {
    (void)network.bus(slot.bus).send(nmt_frame(NmtCommand::enter_pre_operational, slot.drive->node()));
  }
}

}  // namespace proxarm::fieldbus
