// The modes of operation (CiA 402, 6060h) that proxarm supports, and their PDOs, which are sent at every SYNC
// (little-endian):
//
//   csp, ip   RPDO1   controlword (u16), target position (i32)
//             TPDO1   statusword (u16), position (i32)
//   cst       RPDO1   controlword (u16), target torque (i16, 0.1 %)
//             TPDO1   statusword (u16), position (i32), torque (i16, 0.1 %)
//
// The cell's `objects` may name other objects than the profile's for these contents. Torques are in thousandths of the
// motor's rated torque (6076h), with the sign of the counts.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "fieldbus/canopen/canopen_pdo.hpp"
#include "models/description/cell.hpp"

namespace proxarm::fieldbus {

struct CyclicMode {
  const char* name;      // the mode's name in the cell file
  std::uint8_t number;   // value of 6060h; in 6502h the mode has bit number − 1
  std::uint32_t target;  // target object, encoded as in description::DriveObjects
  bool torque;
  std::uint16_t controlword_bits;  // sent with `enable operation`; they mark targets as valid
  const char* unsupported;         // message for a drive that lacks the mode
  // Message for a drive that doesn't change to the mode.
  const char* not_taken;
};

[[nodiscard]] constexpr ObjectAddress object_address(std::uint32_t object) noexcept {
  return {static_cast<std::uint16_t>(object >> 8), static_cast<std::uint8_t>(object)};
}

// Returns the drive's mode. A drive with any other mode gets csp.
[[nodiscard]] const CyclicMode& mode_of(const description::DriveDescription& drive) noexcept;

[[nodiscard]] std::vector<MappedObject> rpdo_mapping(const description::DriveDescription& drive);
[[nodiscard]] std::vector<MappedObject> tpdo_mapping(const description::DriveDescription& drive,
                                                     bool torque_feedback = true);
// Returns the first byte of the actual torque (6077h, 16 bits) in TPDO1 in a position mode; nullopt if the cell's
// `feedback` lacks 6077h.
[[nodiscard]] std::optional<std::uint8_t> extra_torque_byte(const description::DriveDescription& drive) noexcept;
// Returns the first byte of `gear_torque` in TPDO1, where it is the last object; nullopt if the cell has no
// `gear_torque`.
[[nodiscard]] std::optional<std::uint8_t> gear_torque_byte(const description::DriveDescription& drive) noexcept;
// Returns the byte of the mode display (6061h, 8 bits) in TPDO1; nullopt if the cell's `feedback` lacks 6061h.
[[nodiscard]] std::optional<std::uint8_t> mode_display_byte(const description::DriveDescription& drive,
                                                            bool torque_feedback = true) noexcept;
[[nodiscard]] std::uint8_t pdo_bytes(const std::vector<MappedObject>& mapping) noexcept;

}  // namespace proxarm::fieldbus
