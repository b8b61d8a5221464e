// The identifiers that a session uses for a drive. They follow from the node number by CiA 301's predefined connection
// set.
#pragma once

#include <array>
#include <cstdint>

#include "fieldbus/canopen/canopen_emcy.hpp"
#include "fieldbus/canopen/canopen_heartbeat.hpp"
#include "fieldbus/canopen/canopen_pdo.hpp"
#include "fieldbus/canopen/canopen_sdo.hpp"

namespace proxarm::fieldbus {

// Returns four identifiers that the drive sends (TPDO1, EMCY, SDO answer, heartbeat) and two that the master sends
// (RPDO1, SDO request).
inline std::array<std::uint32_t, 6> drive_identifiers(std::uint8_t node) noexcept {
  return {pdo_id(PdoDirection::transmit, 1, node),
          emcy_id(node),
          SdoClient::answer_id(node),
          heartbeat_id(node),
          pdo_id(PdoDirection::receive, 1, node),
          SdoClient::request_id(node)};
}

}  // namespace proxarm::fieldbus
