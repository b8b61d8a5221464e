// Configures PDOs (CiA 301, 7.2.2 and 7.5.2.35 to 7.5.2.38): which objects each PDO carries, and when it is sent.
//
// Identifiers of the predefined connection set:
// - TPDO1..4 (drive to master): 180, 280, 380, 480 + node
// - RPDO1..4 (master to drive): 200, 300, 400, 500 + node
// Communication parameters of PDO n: object 1400h + n − 1 (RPDO) or 1800h + n − 1 (TPDO)
// - :01 COB-ID; bit 31: the PDO doesn't exist; bit 30: no remote request
// - :02 transmission type; 1: at every SYNC
// - :05 event timer in ms; for an RPDO it is the timeout
// Mapping of PDO n: object 1600h + n − 1 (RPDO) or 1A00h + n − 1 (TPDO)
// - :00 number of mapped objects
// - :01.. index << 16 | sub-index << 8 | bits
//
// A mapping may only change while the PDO doesn't exist. This fixes the order of writes: disable the PDO, clear the
// mapping, write the mapped objects, write their number, write the parameters, enable the PDO.
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
  std::uint16_t event_timer_ms = 0;  // the object is written only if this is above 0
  bool fd = false;                   // CAN FD: up to 64 data bytes (CiA 1301); false: up to 8
  std::vector<MappedObject> mapping{};
};

// Returns the identifier in the predefined connection set. Preconditions: `number` is 1..4, `node` is 1..127.
[[nodiscard]] std::uint32_t pdo_id(PdoDirection direction, std::uint8_t number, std::uint8_t node) noexcept;
// True for identifiers that the standard reserves (NMT, SDO, heartbeat, …), which no PDO may have (7.3.5, table 40).
[[nodiscard]] bool is_restricted_id(std::uint32_t id) noexcept;
[[nodiscard]] std::uint32_t mapping_entry(const MappedObject& mapped) noexcept;

// Returns the steps that configure the PDO. Throws std::invalid_argument (a programmer's mistake) if the identifier or
// the number is invalid, or if the mapping is empty or longer than 64 bits (CAN FD: 64 bytes).
[[nodiscard]] std::vector<SdoStep> pdo_steps(const PdoConfiguration& pdo);
// Returns the step that disables an unused PDO, which would otherwise load the bus. The step is optional, because the
// drive may not have this PDO.
[[nodiscard]] SdoStep disable_pdo_step(PdoDirection direction, std::uint8_t number, std::uint8_t node);

}  // namespace proxarm::fieldbus
