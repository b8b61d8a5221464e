// PDOs (CiA 301, 7.2.2 and 7.5.2.35 to 7.5.2.38): which objects each frame carries, and when it is sent.
//
// Identifiers of the predefined connection set: TPDO1..4 180/280/380/480 + node (drive to master), RPDO1..4
// 200/300/400/500 + node. Communication parameters 1400h/1800h + n − 1: :01 COB-ID (bit 31: PDO doesn't exist, bit 30:
// no remote request), :02 transmission type (1: every SYNC), :05 event timer in ms (RPDO: timeout). Mapping 1600h/1A00h
// + n − 1: :00 number of objects, :01.. index << 16 | sub-index << 8 | bits.
//
// A mapping may only change while the PDO doesn't exist. Hence the order: disable, clear, write, count, parameters,
// enable.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "fieldbus/canopen/canopen_sequence.hpp"

namespace proxarm::fieldbus {

enum class PdoDirection : std::uint8_t {
  receive,   // RPDO: from the master to the drive
  transmit,  // TPDO: from the drive to the master
};

inline constexpr std::uint8_t every_sync = 1;  // transmission type

struct MappedObject {
  ObjectAddress object;
  std::uint8_t bits = 0;
};

struct PdoConfiguration {
  PdoDirection direction = PdoDirection::receive;
  std::uint8_t number = 1;  // 1..4
  std::uint32_t id = 0;     // 11-bit identifier
  std::uint8_t transmission_type = every_sync;
  std::uint16_t event_timer_ms = 0;  // 0: not written
  bool fd = false;                   // CAN FD: up to 64 bytes (CiA 1301), else 8
  std::vector<MappedObject> mapping{};
};

// Identifier of the predefined connection set; `number` 1..4, `node` 1..127.
[[nodiscard]] std::uint32_t pdo_id(PdoDirection direction, std::uint8_t number, std::uint8_t node) noexcept;
// Identifiers reserved by the standard (NMT, SDO, heartbeat, …), which no PDO may have (7.3.5, table 40).
[[nodiscard]] bool is_restricted_id(std::uint32_t id) noexcept;
[[nodiscard]] std::uint32_t mapping_entry(const MappedObject& mapped) noexcept;

// Throws std::invalid_argument (a programmer's mistake) for an invalid identifier or number, and for a mapping that is
// empty or longer than 64 bits (CAN FD: 64 bytes).
[[nodiscard]] std::vector<SdoStep> pdo_steps(const PdoConfiguration& pdo);
// Disables an unused PDO, which would load the bus. Optional: the drive may not have it.
[[nodiscard]] SdoStep disable_pdo_step(PdoDirection direction, std::uint8_t number, std::uint8_t node);

}  // namespace proxarm::fieldbus
