// EMCY (CiA 301, 7.2.7): a drive reports an error once, and once that the error is over.
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

// True if the frame is this node's EMCY. Frames may be shorter than eight bytes; missing bytes read as zero, but the
// error code is required.
bool decode_emcy(const CanFrame& frame, std::int64_t time_ns, std::uint8_t node, Emergency& out) noexcept;

// True if the drive works on: 8120h (its CAN controller counts many errors, but still communicates), 8220h (a PDO was
// longer than its mapping; its first bytes count), and codes of communication (81xxh) or the maker (FFxxh) with an
// empty error register. Any other code counts as a fault: CiA 301 and 402 have no warnings, a drive that trips reports
// that by EMCY first, and some drives don't fill their error register.
[[nodiscard]] bool is_warning(const Emergency& emergency) noexcept;
// The wording of CiA 301 (classes) or CiA 402 (drives); the class's wording if the exact code is unknown.
[[nodiscard]] std::string_view emcy_text(std::uint16_t code) noexcept;
// "EMCY 8130: life guard error or heartbeat error (error register 11: generic, communication)"
[[nodiscard]] std::string describe(const Emergency& emergency);

}  // namespace proxarm::fieldbus
