// EMCY (CiA 301, 7.2.7): a drive says, once and by itself, that something went wrong, and once that it is over.
//
// Wire: identifier 080 + node, eight bytes: error code (u16, little-endian), error register (1001h), five bytes of the
// maker's own. Code 0000 means: error reset or no error.
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

// True when the frame is this node's EMCY. Shorter ones than eight bytes occur; what is missing reads as zero, but
// without an error code it isn't one.
bool decode_emcy(const CanFrame& frame, std::int64_t time_ns, std::uint8_t node, Emergency& out) noexcept;

// Whether the drive goes on as before, by its own words: 8120h (its CAN controller counts many errors, but hears and
// speaks), 8220h (a PDO was longer than its mapping, of which the first bytes count), and codes of the communication
// (81xxh) and the maker's (FFxxh) with no bit in the error register. Any other is taken for a fault: CiA 301 and 402
// have no class for warnings, a drive that trips says so by EMCY first, and not each fills its error register.
[[nodiscard]] bool is_warning(const Emergency& emergency) noexcept;
// The wording of CiA 301 (classes) and CiA 402 (drives) for a code; the class's where the exact code isn't known.
[[nodiscard]] std::string_view emcy_text(std::uint16_t code) noexcept;
// "EMCY 8130: life guard error or heartbeat error (error register 11: generic, communication)"
[[nodiscard]] std::string describe(const Emergency& emergency);

}  // namespace proxarm::fieldbus
