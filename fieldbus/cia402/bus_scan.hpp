// Lists the CANopen nodes of a bus, for `proxarm scan`.
//
// The scan first listens, because a bus that another controller leads must not be disturbed (bus_leader.hpp). It then
// sends only SDO uploads, which change nothing. An ATI Net CAN OEM is polled only at a base id that the user gives,
// because the identifiers of a guessed base id could be an NMT command or a setpoint. Sensors that stream appear among
// the received identifiers.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "fieldbus/can/can_network.hpp"

namespace proxarm::fieldbus {

struct ScanSettings {
  std::int64_t listen_ns = 1'000'000'000;
  // Pause between the requests to two nodes. One request per ms with its answer loads a bus of 1 Mbit/s by 13 %.
  std::int64_t between_nodes_ns = 1'000'000;
  std::int64_t answer_ns = 100'000'000;         // timeout for the answer to the last request
  std::optional<std::uint32_t> sensor_base_id;  // 0x09 to 0x7F
};

struct ScannedNode {
  std::uint8_t node = 0;
  bool refused_1000 = false;  // the node answers a read of 1000h with an abort, against CiA 301
  // nullopt: the node lacks the object.
  std::optional<std::uint32_t> device_type, vendor, product, revision, serial;  // 1000h, 1018h:01..04
  std::optional<std::uint32_t> supported_modes, mode, statusword;               // 6502h, 6061h, 6041h
};

struct HeardIdentifier {
  std::uint32_t id = 0;
  bool extended = false, fd = false;
  std::uint64_t frames = 0;
  std::uint8_t length = 0;  // length of the last frame, in bytes
};

struct ScanResult {
  std::vector<HeardIdentifier> heard;  // identifiers received while the scan only listened, sorted
  std::vector<ScannedNode> nodes;      // nodes that answered, sorted by node number
  std::optional<std::array<std::int16_t, 6>> sensor_gauges;
  std::uint16_t sensor_status = 0;
};

// Scans one bus. Throws SetupError if another controller leads the bus, if the bus can't send, or if the base id is
// invalid.
[[nodiscard]] ScanResult scan_bus(CanNetwork& network, std::size_t bus, const ScanSettings& settings = {});

// Returns the result as text for the user, each line with a newline.
[[nodiscard]] std::string scan_text(const ScanResult& result, const ScanSettings& settings);

// Returns the supported modes (6502h) as text, such as "CSP, CST"; "none" for 0.
[[nodiscard]] std::string supported_modes_text(std::uint32_t modes);
// Returns the meaning of an 11-bit identifier in the predefined connection set, such as "TPDO1 of node 3".
[[nodiscard]] std::string connection_text(std::uint32_t id);

}  // namespace proxarm::fieldbus
