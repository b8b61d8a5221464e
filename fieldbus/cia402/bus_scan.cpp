#include "fieldbus/cia402/bus_scan.hpp"

#include <algorithm>

#include "fieldbus/can/byte_order.hpp"
#include "fieldbus/can/frame_pump.hpp"
#include "fieldbus/canopen/bus_leader.hpp"
#include "fieldbus/canopen/canopen_object.hpp"
#include "fieldbus/canopen/canopen_sdo.hpp"
#include "fieldbus/canopen/canopen_sync.hpp"
#include "fieldbus/cia402/cia402_state.hpp"
#include "models/base/setup_error.hpp"

namespace proxarm::fieldbus {
namespace {

using description::SetupError;

constexpr std::uint32_t from_server = 0x580;
constexpr std::uint8_t last_node = 127;

struct Reading {
  ObjectAddress object;
  std::optional<std::uint32_t> ScannedNode::*value;
};
constexpr Reading readings[] = {
    {{0x1018, 1}, &ScannedNode::vendor},          {{0x1018, 2}, &ScannedNode::product},
    {{0x1018, 3}, &ScannedNode::revision},        {{0x1018, 4}, &ScannedNode::serial},
    {{0x6502, 0}, &ScannedNode::supported_modes}, {{0x6061, 0}, &ScannedNode::mode},
    {{0x6041, 0}, &ScannedNode::statusword},
};

struct Answer {
  bool aborted = false;
  std::optional<std::uint32_t> value;
};

// Decodes the answer to an SDO upload of `object`; nullopt if the frame is no such answer. Byte 0 is 80 for an abort.
// For an expedited answer it is 010x nnes with e = 1; if s = 1, nn is the number of unused bytes of the four. Objects
// of more than four bytes aren't read.
std::optional<Answer> answer_of(const CanFrame& frame, std::uint8_t node, ObjectAddress object) {
  if (frame.extended || frame.remote || frame.error || frame.length != 8 || frame.id != from_server + node) return {};
  if (read_u16_le(&frame.data[1]) != object.index || frame.data[3] != object.sub) return {};
  if (frame.data[0] == 0x80) return Answer{.aborted = true, .value = {}};
  if ((frame.data[0] & 0xE2U) != 0x42) return {};
  const unsigned unused = (frame.data[0] & 1U) != 0 ? frame.data[0] >> 2 & 3U : 0U;
  return Answer{.aborted = false, .value = read_u32_le(&frame.data[4]) & 0xFFFFFFFFU >> (8 * unused)};
}

class Scan {
 public:
  Scan(CanNetwork& network, std::size_t bus, const ScanSettings& settings)
      : network_(network), bus_(bus), settings_(settings) {}

  void listen(ScanResult& result) {
    std::map<std::pair<std::uint32_t, bool>, HeardIdentifier> heard;
    const FrameHandler note = [&](std::size_t from, const TimedFrame& received) {
      const CanFrame& frame = received.frame;
      if (from != bus_ || frame.error) return;
      HeardIdentifier& one = heard[{frame.id, frame.extended}];
      one.id = frame.id;
      one.extended = frame.extended;
      one.fd = frame.fd;
      one.length = frame.length;
      ++one.frames;
    };
    const BusToLead bus{.bus = bus_};
    require_nobody_leads(network_, {&bus, 1}, settings_.listen_ns, note);
    for (const auto& entry : heard) result.heard.push_back(entry.second);
  }

  void find_nodes(ScanResult& result) {
    constexpr ObjectAddress device_type{0x1000, 0};
    const auto note = [&](const CanFrame& frame) {
      if (frame.id <= from_server || frame.id > from_server + last_node) return;
      const auto node = static_cast<std::uint8_t>(frame.id - from_server);
      const auto answer = answer_of(frame, node, device_type);
      const bool known = std::any_of(result.nodes.begin(), result.nodes.end(),
                                     [node](const ScannedNode& other) { return other.node == node; });
      if (!answer || known) return;
      ScannedNode found;
      found.node = node;
      found.refused_1000 = answer->aborted;
      found.device_type = answer->value;
      result.nodes.push_back(found);
    };
    for (std::uint8_t node = 1; node <= last_node; ++node) {
      send(upload_request(node, device_type));
      pump(network_.now_ns() + settings_.between_nodes_ns, note);
    }
    pump(network_.now_ns() + settings_.answer_ns, note);
    std::sort(result.nodes.begin(), result.nodes.end(),
              [](const ScannedNode& a, const ScannedNode& b) { return a.node < b.node; });
  }

  void ask(ScannedNode& node) {
    for (const Reading& reading : readings) {
      send(upload_request(node.node, reading.object));
      bool answered = false;
      const auto take = [&](const CanFrame& frame) {
        const auto answer = answer_of(frame, node.node, reading.object);
        if (!answer) return;
        node.*reading.value = answer->value;
        answered = true;
      };
      pump(network_.now_ns() + settings_.answer_ns, take, &answered);
    }
  }

  // Polls an ATI Net CAN OEM by its operation 0. The first answer holds status, SG0, SG2 and SG4, the second SG1, SG3
  // and SG5.
  void poll_sensor(std::uint32_t base_id, ScanResult& result) {
    CanFrame request;
    request.id = base_id << 4;
    send(request);
    std::array<std::int16_t, 6> gauges{};
    bool even = false, both = false;
    const auto take = [&](const CanFrame& frame) {
      if (frame.extended || frame.error || frame.id >> 4 != base_id) return;
      const bool first = (frame.id & 0xF) == 0 && frame.length == 8,
                 second = (frame.id & 0xF) == 1 && frame.length == 6;
      if (first) result.sensor_status = read_u16_be(&frame.data[0]);
      for (std::size_t i = 0; i < 3 && (first || second); ++i) {
        gauges[2 * i + (first ? 0 : 1)] = read_i16_be(&frame.data[2 * i + (first ? 2 : 0)]);
      }
      even = even || first;
      both = both || (even && second);
    };
    pump(network_.now_ns() + settings_.answer_ns, take, &both);
    if (both) result.sensor_gauges = gauges;
  }

 private:
  template <class Handler>
  void pump(std::int64_t deadline_ns, Handler handler, const bool* done = nullptr) {
    const FrameHandler on_frame = [&](std::size_t from, const TimedFrame& received) {
      if (from == bus_) handler(received.frame);
    };
    pump_frames(network_, deadline_ns, on_frame,
                [&](std::int64_t) { return done != nullptr && *done ? pump_done : deadline_ns; });
  }

  void send(const CanFrame& frame) {
    // A full queue has space again after a few frames, so the frame is sent again after a pause.
    SendResult sent = network_.bus(bus_).send(frame);
    for (int attempt = 0; sent == SendResult::queue_full && attempt < 20; ++attempt) {
      network_.sleep_until(network_.now_ns() + settings_.between_nodes_ns);
      sent = network_.bus(bus_).send(frame);
    }
    if (sent == SendResult::sent) return;
    throw SetupError({.bus = network_.bus(bus_).name(),
                      .message = "the scan's requests don't leave",
                      .found = sent == SendResult::bus_off      ? "bus-off"
                               : sent == SendResult::queue_full ? "a queue that stays full"
                                                                : "an interface that is down",
                      .expected = "a bus with at least one other node, at the same bitrate",
                      .advice = "check the bitrate, the wiring and both terminations (120 ohm)"});
  }

  CanNetwork& network_;
  std::size_t bus_;
  const ScanSettings& settings_;
};

std::string optional_text(const char* name, const std::optional<std::uint32_t>& value) {
  return value ? std::string(", ") + name + " " + hex_text(*value, 8) : std::string();
}

std::string node_text(const ScannedNode& node) {
  std::string text = "  node " + std::to_string(node.node) + ": ";
  if (node.refused_1000) return text + "answers, but refuses its device type (1000h)\n";
  const std::uint32_t type = node.device_type.value_or(0);
  text += "device type " + hex_text(type, 8) + ((type & 0xFFFF) == 402 ? " (CiA 402 drive)" : "");
  text += optional_text("vendor", node.vendor) + optional_text("product", node.product) +
          optional_text("revision", node.revision);
  if (node.serial) text += ", serial number " + std::to_string(*node.serial);
  if (node.supported_modes) text += ", modes " + supported_modes_text(*node.supported_modes);
  if (node.mode) text += ", now in mode " + std::to_string(static_cast<std::int8_t>(*node.mode & 0xFF));
  if (node.statusword) {
    text += ", " + std::string(to_string(decode_state(static_cast<std::uint16_t>(*node.statusword))));
  }
  return text + "\n";
}

}  // namespace

std::string supported_modes_text(std::uint32_t modes) {
  constexpr std::array<const char*, 10> names{"PP", "VL", "PV", "PT", "mode 5", "HM", "IP", "CSP", "CSV", "CST"};
  std::string text;
  for (std::size_t bit = 0; bit < names.size(); ++bit) {
    if ((modes >> bit & 1U) != 0) text += (text.empty() ? "" : " ") + std::string(names[bit]);
  }
  return text.empty() ? "none" : text;
}

std::string connection_text(std::uint32_t id) {
  constexpr std::array<const char*, 16> names{
      "",      "EMCY",  "",      "TPDO1",      "RPDO1",       "TPDO2", "RPDO2",     "TPDO3",
      "RPDO3", "TPDO4", "RPDO4", "SDO answer", "SDO request", "",      "heartbeat", ""};
  if (id == 0x000) return "NMT command";
  if (id == sync_id) return "SYNC";
  if (id == 0x100) return "TIME";
  const std::uint32_t node = id & 0x7F;
  const std::string name = id <= 0x7FF && node != 0 ? names[id >> 7] : "";
  return name.empty() ? "no CANopen connection: a sensor?" : name + " of node " + std::to_string(node);
}

ScanResult scan_bus(CanNetwork& network, std::size_t bus, const ScanSettings& settings) {
  if (settings.sensor_base_id && (*settings.sensor_base_id < 0x09 || *settings.sensor_base_id > 0x7F)) {
    throw SetupError({.key = "--poll-sensor",
                      .found = hex_text(*settings.sensor_base_id, 2),
                      .expected = "0x09 to 0x7F: a poll below would be an NMT command, SYNC or an EMCY"});
  }
  ScanResult result;
  Scan scan(network, bus, settings);
  scan.listen(result);
  scan.find_nodes(result);
  for (ScannedNode& node : result.nodes) scan.ask(node);
  if (settings.sensor_base_id) scan.poll_sensor(*settings.sensor_base_id, result);
  return result;
}

std::string scan_text(const ScanResult& result, const ScanSettings& settings) {
  std::string text = "heard: " + std::string(result.heard.empty() ? "nothing" : "") + "\n";
  for (const HeardIdentifier& one : result.heard) {
    text += "  " + hex_text(one.id, one.extended ? 8 : 3) + ": " + std::to_string(one.frames) + " frames of " +
            std::to_string(one.length) + " bytes" + (one.fd ? " (CAN FD)" : "") + ", " +
            (one.extended ? "29 bits: a sensor?" : connection_text(one.id)) + "\n";
  }
  text += "CANopen nodes: " + std::string(result.nodes.empty() ? "none answers" : "") + "\n";
  for (const ScannedNode& node : result.nodes) text += node_text(node);
  if (!settings.sensor_base_id) return text;
  text += "sensor at base id " + hex_text(*settings.sensor_base_id, 2) + ": ";
  if (!result.sensor_gauges) return text + "no answer to an ATI Net CAN OEM's poll\n";
  text += "ATI Net CAN OEM, status " + hex_text(result.sensor_status, 4) + ", gauges";
  for (const std::int16_t gauge : *result.sensor_gauges) text += " " + std::to_string(gauge);
  return text + "\n";
}

}  // namespace proxarm::fieldbus
