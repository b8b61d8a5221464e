// The modes of operation (CiA 402, 6060h) that drives are led in, and what travels in their PDOs then, every SYNC,
// numbers little-endian:
//
//   csp, ip   RPDO1  controlword (u16), target position (i32)          TPDO1  statusword (u16), position (i32)
//   cst       RPDO1  controlword (u16), target torque (i16, 0.1 %)     TPDO1  the same, torque (i16, 0.1 %)
//
// A drive may have any of these in an object of its own (the cell's `objects`).
//
// Torques are thousandths of the motor's rated torque (6076h), by the sense of the counts.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "fieldbus/canopen/canopen_pdo.hpp"
#include "models/description/cell.hpp"

namespace proxarm::fieldbus {

struct CyclicMode {
  const char* name;      // in a cell's file
  std::uint8_t number;   // 6060h; 6502h has it as bit number − 1
  std::uint32_t target;  // as in description::DriveObjects
  bool torque;
  std::uint16_t controlword_bits;  // set with `enable operation`: that its targets are valid
  const char* unsupported;         // what the user is told of a drive that hasn't got it, or that doesn't change to it
  const char* not_taken;
};

[[nodiscard]] constexpr ObjectAddress object_address(std::uint32_t object) noexcept {
  return {static_cast<std::uint16_t>(object >> 8), static_cast<std::uint8_t>(object)};
}

// Of a drive whose mode is one of these; any other is taken as csp.
[[nodiscard]] const CyclicMode& mode_of(const description::DriveDescription& drive) noexcept;

[[nodiscard]] std::vector<MappedObject> rpdo_mapping(const description::DriveDescription& drive);
[[nodiscard]] std::vector<MappedObject> tpdo_mapping(const description::DriveDescription& drive,
                                                     bool torque_feedback = true);
// The first byte of the actual torque (6077h, 16 bits) in TPDO1 of a drive that takes positions; none: its cell's
// `feedback` doesn't have it.
[[nodiscard]] std::optional<std::uint8_t> extra_torque_byte(const description::DriveDescription& drive) noexcept;
// The first byte of `gear_torque`, which comes last.
[[nodiscard]] std::optional<std::uint8_t> gear_torque_byte(const description::DriveDescription& drive) noexcept;
// The byte of the mode display (6061h, 8 bits) in TPDO1, where the cell's `feedback` has it.
[[nodiscard]] std::optional<std::uint8_t> mode_display_byte(const description::DriveDescription& drive,
                                                            bool torque_feedback = true) noexcept;
[[nodiscard]] std::uint8_t pdo_bytes(const std::vector<MappedObject>& mapping) noexcept;

}  // namespace proxarm::fieldbus
