// EMCY (CiA 301, 7.2.7): the frame by which a drive reports an error when it occurs, and again when it has ended.
//
// Wire: identifier 080 + node, eight bytes: error code (u16, little-endian), error register (1001h), five bytes that
// the maker defines. Code 0000: error reset or no error.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>

#include "fieldbus/can/can_frame.hpp"

namespace proxarm::fieldbus {

inline constexpr std::uint32_t emcy_id(std::uint8_t node) noexcept { return 0x080U + node; }

struct Emergency {
  std::uint16_t code = 0;
  std::uint8_t error_register = 0;
  std::array<std::uint8_t, 5> vendor{};
  std::int64_t time_ns = 0;
};

// Decodes the frame. True if the frame is this node's EMCY. A frame may be shorter than eight bytes, but must hold the
// error code; missing bytes are read as zero.
bool decode_emcy(const CanFrame& frame, std::int64_t time_ns, std::uint8_t node, Emergency& out) noexcept;

// True if the drive keeps working in spite of this EMCY. That holds for these codes:
// - 8120h: the drive's CAN controller counts many errors, but still communicates.
// - 8220h: a PDO was longer than its mapping; the drive uses the PDO's first bytes.
// - communication codes (81xxh) and the maker's codes (FFxxh), if the error register is 0
// Any other code counts as a fault, for three reasons: CiA 301 and 402 define no warnings; a drive that trips reports
// the trip by EMCY first; and some drives don't fill their error register.
[[nodiscard]] bool is_warning(const Emergency& emergency) noexcept;
// Returns the wording of CiA 301 (classes of codes) or CiA 402 (drives). For an unknown code it is the wording of the
// code's class.
[[nodiscard]] std::string_view emcy_text(std::uint16_t code) noexcept;
// Returns for example "EMCY 8130: life guard error or heartbeat error (error register 11: generic, communication)".
[[nodiscard]] std::string describe(const Emergency& emergency);

}  // namespace proxarm::fieldbus
