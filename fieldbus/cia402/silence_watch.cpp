#include "fieldbus/cia402/silence_watch.hpp"

#include "fieldbus/can/byte_order.hpp"
#include "fieldbus/canopen/canopen_pdo.hpp"
#include "fieldbus/cia402/drive_exchange.hpp"

namespace proxarm::fieldbus {
namespace {

constexpr std::uint8_t words_pdo = 3;  // TPDO2 may carry the enabling input
constexpr std::uint16_t words_every_ms = 5, heartbeat_every_ms = 10;
constexpr std::uint8_t on_change = 255;

std::vector<SdoStep> words_steps(const ServoDrive& drive) {
  std::vector<SdoStep> steps;
  // CiA 301 doesn't allow a node to use heartbeat and life guarding together.
  if (drive.description().bring_up.stops_by != description::StopsBy::life_guarding) {
    steps.push_back(sdo_write({0x1017, 0}, 2, heartbeat_every_ms, "producer heartbeat time"));
  }
  const PdoConfiguration words{.direction = PdoDirection::transmit,
                               .number = words_pdo,
                               .id = pdo_id(PdoDirection::transmit, words_pdo, drive.node()),
                               .transmission_type = on_change,
                               .event_timer_ms = words_every_ms,
                               .mapping = {{object_address(drive.description().objects.statusword), 16}}};
  for (const SdoStep& step : pdo_steps(words)) steps.push_back(if_present(step));
  return steps;
}

}  // namespace

void ask_for_words(CanNetwork& network, std::span<const DriveSlot> drives) {
  (void)exchange(network, drives, handed_to(drives), words_steps);
}

std::vector<DriveState> ask_for_states(CanNetwork& network, std::span<const DriveSlot> drives) {
  const auto word = [](const ServoDrive& drive) { return object_address(drive.description().objects.statusword); };
  const std::vector<SdoSequence> answers = exchange(network, drives, handed_to(drives), [&](const ServoDrive& drive) {
    return std::vector<SdoStep>{sdo_read(word(drive), 2, "statusword")};
  });
  std::vector<DriveState> states;
  for (std::size_t i = 0; i < drives.size(); ++i) {
    const auto value = answers[i].value_of(word(*drives[i].drive));
    states.push_back(value ? decode_state(static_cast<std::uint16_t>(*value)) : DriveState::unknown);
  }
  return states;
}

std::uint32_t SilenceWatch::wanted_id() const noexcept { return pdo_id(PdoDirection::transmit, words_pdo, node_); }

void SilenceWatch::react(std::int64_t time_ns) noexcept {
  if (reacted_ns_ < 0) reacted_ns_ = time_ns;
}

void SilenceWatch::on_frame(const CanFrame& frame, std::int64_t time_ns) noexcept {
  if (frame.extended || frame.remote || frame.error) return;
  if (Emergency emergency; decode_emcy(frame, time_ns, node_, emergency)) {
    if (emergency.code == 0) return;
    if (emcy_ == 0) emcy_ = emergency.code;
    // 8100h (the stack misses SYNC) is no sign of a stop: the drive keeps moving. Its state shows when it stops.
    constexpr std::uint16_t communication = 0x8100;
    if (emergency.code != communication) react(time_ns);
  } else if (frame.id == heartbeat_id(node_) && frame.length == 1) {
    const auto state = static_cast<NmtState>(frame.data[0]);
    if (state == NmtState::operational) return;
    nmt_ = state;
    react(time_ns);
  } else if (frame.id == wanted_id() && frame.length >= 2) {
    const std::uint16_t word = read_u16_le(frame.data.data());
    const DriveState state = decode_state(word);
    if (state == DriveState::operation_enabled) return;
    statusword_ = word;
    react(time_ns);
    const bool moves = state == DriveState::quick_stop_active || state == DriveState::fault_reaction_active;
    if (!moves && off_ns_ < 0) off_ns_ = time_ns;
  }
}

std::string SilenceWatch::signs() const {
  std::string text;
  const auto add = [&text](const std::string& more) { text += (text.empty() ? "" : ", ") + more; };
  if (emcy_ != 0) {
    add("EMCY " + hex_text(emcy_, 4).substr(2) + "h (" + std::string(emcy_text(emcy_)) + ")");
  }
  if (statusword_ != 0) {
    add(std::string(to_string(decode_state(statusword_))) + " (statusword " + hex_text(statusword_, 4) + ")");
  }
  if (nmt_ != NmtState::operational) add("NMT " + std::string(to_string(nmt_)));
  return text.empty() ? "nothing" : text;
}

}  // namespace proxarm::fieldbus
