// The modes of operation (CiA 402, 6060h) that proxarm supports, and their PDOs, sent every SYNC, little-endian:
//
//   csp, ip   RPDO1  controlword (u16), target position (i32)          TPDO1  statusword (u16), position (i32)
//   cst       RPDO1  controlword (u16), target torque (i16, 0.1 %)     TPDO1  the same, torque (i16, 0.1 %)
//
// The cell's `objects` may name other objects for them. Torques are thousandths of the motor's rated torque (6076h),
// signed like the counts.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "fieldbus/canopen/canopen_pdo.hpp"
#include "models/description/cell.hpp"

namespace proxarm::fieldbus {

struct CyclicMode {
  const char* name;      // in the cell file
  std::uint8_t number;   // value of 6060h; bit number + 1 in 6502h
  std::uint32_t target;  // as in description::DriveObjects
  bool torque;
  std::uint16_t controlword_bits;  // set with `enable operation`: marks targets as valid
  const char* unsupported;         // message for a drive that lacks the mode, or doesn't change to it
  const char* not_taken;
};

[[nodiscard]] constexpr ObjectAddress object_address(std::uint32_t object) noexcept {
  return {static_cast<std::uint16_t>(object >> 8), static_cast<std::uint8_t>(object)};
}

// Any other mode counts as csp.
[[nodiscard]] const CyclicMode& mode_of(const description::DriveDescription& drive) noexcept;

[[nodiscard]] std::vector<MappedObject> rpdo_mapping(const description::DriveDescription& drive);
[[nodiscard]] std::vector<MappedObject> tpdo_mapping(const description::DriveDescription& drive,
                                                     bool torque_feedback = true);
// First byte of the actual torque (6077h, 16 bits) in TPDO1 in a position mode; nullopt if the cell's `feedback` lacks
// it.
[[nodiscard]] std::optional<std::uint8_t> extra_torque_byte(const description::DriveDescription& drive) noexcept;
// First byte of `gear_torque`, which comes last.
[[nodiscard]] std::optional<std::uint8_t> gear_torque_byte(const description::DriveDescription& drive) noexcept;
// Byte of the mode display (6061h, 8 bits) in TPDO1, if the cell's `feedback` has it.
[[nodiscard]] std::optional<std::uint8_t> mode_display_byte(const description::DriveDescription& drive,
                                                            bool torque_feedback = true) noexcept;
[[nodiscard]] std::uint8_t pdo_bytes(const std::vector<MappedObject>& mapping) noexcept;

}  // namespace proxarm::fieldbus
