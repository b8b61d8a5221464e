// Lists the CANopen nodes of a bus, for `proxarm scan`.
//
// It first listens, since a bus led by another controller must not be disturbed (bus_leader.hpp). Then it only sends
// SDO uploads, which change nothing. An ATI Net CAN OEM is polled only at a base id that the user gives: a guessed
// identifier can be an NMT command or a setpoint. Streaming sensors show among the received identifiers.
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
  std::int64_t between_nodes_ns = 1'000'000;    // with its answer, one request per ms is 13 % of 1 Mbit/s
  std::int64_t answer_ns = 100'000'000;         // timeout of the last answer
  std::optional<std::uint32_t> sensor_base_id;  // 0x09 to 0x7F
};

struct ScannedNode {
  std::uint8_t node = 0;
  bool refused_1000 = false;  // its answer is an abort, against CiA 301
  // nullopt: the node lacks the object.
  std::optional<std::uint32_t> device_type, vendor, product, revision, serial;  // 1000h, 1018h:01..04
  std::optional<std::uint32_t> supported_modes, mode, statusword;               // 6502h, 6061h, 6041h
};

struct HeardIdentifier {
  std::uint32_t id = 0;
  bool extended = false, fd = false;
  std::uint64_t frames = 0;
  std::uint8_t length = 0;  // of the last frame
};

struct ScanResult {
  std::vector<HeardIdentifier> heard;  // received while only listening, by identifier
  std::vector<ScannedNode> nodes;      // nodes that answered, by number
  std::optional<std::array<std::int16_t, 6>> sensor_gauges;
  std::uint16_t sensor_status = 0;
};

// Throws SetupError if another controller leads the bus, the bus can't send, or the base id is invalid.
[[nodiscard]] ScanResult scan_bus(CanNetwork& network, std::size_t bus, const ScanSettings& settings = {});

// For the user: lines, each with a newline.
[[nodiscard]] std::string scan_text(const ScanResult& result, const ScanSettings& settings);

// 6502h in words: "CSP, CST"; "none" for 0.
[[nodiscard]] std::string supported_modes_text(std::uint32_t modes);
// An 11-bit identifier in the predefined connection set: "TPDO1 of node 3".
[[nodiscard]] std::string connection_text(std::uint32_t id);

}  // namespace proxarm::fieldbus
