#include "fieldbus/canopen/canopen_nmt.hpp"

namespace proxarm::fieldbus {

CanFrame nmt_frame(NmtCommand command, std::uint8_t node) noexcept {
  CanFrame frame;
  frame.id = 0x000;
  frame.length = 2;
  frame.data[0] = static_cast<std::uint8_t>(command);
  frame.data[1] = node;
  return frame;
}

NmtState nmt_state_from_byte(std::uint8_t byte) noexcept {
  switch (byte & 0x7F) {
    case 0x00:
      return NmtState::boot_up;
    case 0x04:
      return NmtState::stopped;
    case 0x05:
      return NmtState::operational;
    case 0x7F:
      return NmtState::pre_operational;
    default:
      return NmtState::unknown;
  }
}

std::string_view to_string(NmtState state) noexcept {
  switch (state) {
    case NmtState::boot_up:
      return "boot-up";
    case NmtState::stopped:
      return "stopped";
    case NmtState::operational:
      return "operational";
    case NmtState::pre_operational:
      return "pre-operational";
    case NmtState::unknown:
      break;
  }
  return "unknown";
}

}  // namespace proxarm::fieldbus
