// What is on a CAN bus: listens, then asks every CANopen node what it is. Behind `proxarm scan`.
//
// A bus that somebody leads must not be disturbed: it listens first (bus_leader.hpp). Then it sends SDO uploads (reads)
// and nothing else; it changes nothing in any node. A guessed sensor identifier can be an NMT command or somebody's
// setpoint, so a sensor is polled only at a base id that the user names (ATI Net CAN OEM: one that answers polls; the
// others stream, and show among the identifiers heard).
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
  std::int64_t between_nodes_ns = 1'000'000;    // one request per millisecond is 13 % of 1 Mbit/s with its answer
  std::int64_t answer_ns = 100'000'000;         // how long the last answer may take
  std::optional<std::uint32_t> sensor_base_id;  // 0x09 to 0x7F
};

struct ScannedNode {
  std::uint8_t node = 0;
  bool refused_1000 = false;  // it answers, but with an abort: not what CiA 301 asks of a node
  // What it has of them; an object that it hasn't is left out.
  std::optional<std::uint32_t> device_type, vendor, product, revision, serial;  // 1000h, 1018h:01..04
  std::optional<std::uint32_t> supported_modes, mode, statusword;               // 6502h, 6061h, 6041h
};

struct HeardIdentifier {
  std::uint32_t id = 0;
  bool extended = false, fd = false;
  std::uint64_t frames = 0;
  std::uint8_t length = 0;  // of the last one
};

struct ScanResult {
  std::vector<HeardIdentifier> heard;  // while only listening, by identifier
  std::vector<ScannedNode> nodes;      // that answered, by number
  std::optional<std::array<std::int16_t, 6>> sensor_gauges;
  std::uint16_t sensor_status = 0;
};

// Throws SetupError where somebody leads the bus, the bus can't send, or the base id is no sensor's.
[[nodiscard]] ScanResult scan_bus(CanNetwork& network, std::size_t bus, const ScanSettings& settings = {});

// For people: lines, each ending in a newline.
[[nodiscard]] std::string scan_text(const ScanResult& result, const ScanSettings& settings);

// "CSP, CST" of 6502h; "none" for 0.
[[nodiscard]] std::string supported_modes_text(std::uint32_t modes);
// What the predefined connection set makes of an 11-bit identifier: "TPDO1 of node 3".
[[nodiscard]] std::string connection_text(std::uint32_t id);

}  // namespace proxarm::fieldbus
