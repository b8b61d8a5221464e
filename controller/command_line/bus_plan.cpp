#include "controller/command_line/bus_plan.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "controller/command_line/cell_buses.hpp"
#include "fieldbus/canopen_pdo.hpp"
#include "models/description/setup_error.hpp"

namespace proxarm::command_line {
namespace {

using fieldbus::PlannedBus;
using fieldbus::PlannedFrame;

std::int64_t period_ns(const PreparedSession& session) { return std::llround(session.settings.period_s * 1e9); }

// A frame that comes every `ms` milliseconds, in cycles.
int cycles_of(const PreparedSession& session, int ms) {
  return std::max(1, static_cast<int>(std::int64_t{ms} * 1'000'000 / period_ns(session)));
}

void add_controller_frames(PlannedBus& bus, const PreparedSession& session) {
  const fieldbus::DriveSettings drive;
  PlannedFrame sync{.name = "SYNC", .id = fieldbus::sync_id};
  sync.shape.bytes = 0;
  sync.sender = "controller";
  sync.sync = true;
  bus.frames.push_back(sync);
  PlannedFrame heartbeat{.name = "controller's heartbeat", .id = fieldbus::heartbeat_id(drive.master_node)};
  heartbeat.shape.bytes = 1;
  heartbeat.sender = "controller";
  heartbeat.release = controller::receive_window;
  heartbeat.every_cycles = cycles_of(session, drive.master_heartbeat_ms);
  heartbeat.deadline = cycles_of(session, drive.master_heartbeat_timeout_ms - drive.master_heartbeat_ms);
  bus.frames.push_back(heartbeat);
}

void add_drive(PlannedBus& bus, const description::DriveDescription& drive) {
  const std::uint8_t node = drive.node;
  PlannedFrame feedback{.name = drive.joint + " TPDO1",
                        .id = fieldbus::pdo_id(fieldbus::PdoDirection::transmit, 1, node)};
  feedback.shape.bytes = fieldbus::pdo_bytes(fieldbus::tpdo_mapping(drive));
  feedback.sender = drive.joint;
  feedback.after = "SYNC";
  PlannedFrame target{.name = drive.joint + " RPDO1", .id = fieldbus::pdo_id(fieldbus::PdoDirection::receive, 1, node)};
  target.shape.bytes = fieldbus::pdo_bytes(fieldbus::rpdo_mapping(drive));
  target.sender = "controller";
  target.release = controller::receive_window;
  for (const PlannedFrame& frame : {feedback, target}) bus.frames.push_back(frame);
}

// ATI Net CAN OEM: a poll, and two answers.
void add_sensor(PlannedBus& bus, const PreparedSession& session) {
  const std::uint32_t base = session.cell.sensor.base_id << 4;
  PlannedFrame poll{.name = "sensor poll", .id = base};
  poll.shape.bytes = 0;
  poll.sender = "controller";
  PlannedFrame first{.name = "sensor gauges 0 2 4", .id = base};
  first.shape.bytes = 8;
  first.sender = "sensor";
  first.after = "sensor poll";
  first.deadline = controller::receive_window;
  PlannedFrame second{.name = "sensor gauges 1 3 5", .id = base | 1U};
  second.shape.bytes = 6;
  second.sender = "sensor";
  second.after = "sensor poll";
  second.deadline = controller::receive_window;
  for (const PlannedFrame& frame : {poll, first, second}) bus.frames.push_back(frame);
}

PlannedFrame described_frame(const description::SensorProtocol& protocol, std::uint32_t id, std::size_t bytes) {
  PlannedFrame frame{.name = "", .id = id};
  frame.shape.bytes = static_cast<int>(bytes);
  frame.shape.extended = protocol.extended;
  frame.shape.fd = protocol.fd;
  frame.shape.bit_rate_switch = protocol.bit_rate_switch;
  frame.sender = "sensor";
  return frame;
}

// A polled sensor answers within the receive window. One that streams isn't in step with the cycle; where it sends
// several samples per cycle they follow each other.
void add_described_sensor(PlannedBus& bus, const PreparedSession& session) {
  const description::SensorProtocol& protocol = *session.sensor.described;
  const std::uint32_t base_id = session.cell.sensor.base_id;
  const double cycles = protocol.streams() ? 1.0 / (session.settings.period_s * protocol.rate_Hz) : 1.0;
  const int samples = protocol.streams() ? static_cast<int>(std::ceil(1.0 / std::min(cycles, 1.0) - 1e-9)) : 1;
  std::string before;
  if (protocol.poll) {
    PlannedFrame poll =
        described_frame(protocol, protocol.wire_id(protocol.poll->id, base_id), protocol.poll->data.size());
    poll.name = before = "sensor poll";
    poll.sender = "controller";
    bus.frames.push_back(poll);
  }
  for (int sample = 0; sample < samples; ++sample) {
    for (std::size_t i = 0; i < protocol.frames.size(); ++i) {
      PlannedFrame frame =
          described_frame(protocol, protocol.wire_id(protocol.frames[i].id, base_id), protocol.frames[i].bytes);
      frame.name = "sensor frame " + std::to_string(i + 1) + (samples > 1 ? " of " + std::to_string(sample + 1) : "");
      frame.any_time = protocol.streams() && before.empty();
      frame.after = before;
      if (protocol.streams()) frame.every_cycles = std::max(1, static_cast<int>(cycles));
      if (protocol.poll) frame.deadline = controller::receive_window;
      before = frame.name;
      bus.frames.push_back(frame);
    }
  }
}

PlannedBus planned(const PreparedSession& session, const controller::BusIndices& indices, std::size_t index) {
  PlannedBus bus;
  bus.bitrate = 0;
  for (std::size_t i = 0; i < session.cell.buses.size(); ++i) {
    if (indices[i] != index) continue;
    const description::BusDescription& own = session.cell.buses[i];
    bus.name += (bus.name.empty() ? "" : "+") + own.name;
    // What shares an interface has the slowest of its rates; a classic bus among them makes all of it classic.
    bus.data_bitrate = bus.bitrate == 0 ? own.data_bitrate : std::min(bus.data_bitrate, own.data_bitrate);
    bus.bitrate = bus.bitrate == 0 ? own.bitrate : std::min(bus.bitrate, own.bitrate);
    const auto on_it = [&](const description::DriveDescription& d) { return d.bus == own.name; };
    const bool first_drives =
        std::none_of(bus.frames.begin(), bus.frames.end(), [](const PlannedFrame& f) { return f.sync; });
    if (first_drives && std::any_of(session.cell.drives.begin(), session.cell.drives.end(), on_it)) {
      add_controller_frames(bus, session);
    }
    for (const description::DriveDescription& drive : session.cell.drives) {
      if (on_it(drive)) add_drive(bus, drive);
    }
    if (session.cell.sensor.bus != own.name) continue;
    if (session.sensor.described) {
      add_described_sensor(bus, session);
    } else {
      add_sensor(bus, session);
    }
  }
  return bus;
}

}  // namespace

std::vector<fieldbus::BusPlan> plan_buses(const PreparedSession& session, const controller::BusIndices& indices) {
  std::vector<fieldbus::BusPlan> plans;
  const std::size_t buses = indices.empty() ? 0 : *std::max_element(indices.begin(), indices.end()) + 1;
  for (std::size_t index = 0; index < buses; ++index) {
    plans.push_back(fieldbus::plan_bus(planned(session, indices, index), period_ns(session)));
  }
  return plans;
}

void require_carried(const PreparedSession& session) {
  const std::string refusal = fieldbus::refusal_text(plan_buses(session, buses_in_order(session.cell)));
  if (refusal.empty()) return;
  throw description::SetupError({.key = "--timestep", .message = refusal, .advice = "`proxarm plan` shows each frame"});
}

void warn_if_not_carried(const PreparedSession& session, const controller::BusIndices& indices) {
  const std::string refusal = fieldbus::refusal_text(plan_buses(session, indices));
  if (refusal.empty()) return;
  std::fprintf(stderr, "proxarm: on a real bus this would be refused (a virtual one has no bit timing): %s\n",
               refusal.c_str());
}

}  // namespace proxarm::command_line
