#include "controller/preparation/bus_plan.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>
#include <random>

#include "controller/preparation/cell_buses.hpp"
#include "controller/preparation/session_checks.hpp"
#include "controller/session/identifiers.hpp"
#include "fieldbus/can/byte_order.hpp"
#include "fieldbus/can/socket_can_network.hpp"
#include "fieldbus/canopen/canopen_object.hpp"
#include "fieldbus/canopen/canopen_pdo.hpp"
#include "fieldbus/cia402/cia402_units.hpp"
#include "models/base/setup_error.hpp"
#include "models/base/text.hpp"
#include "sim/devices/described_device.hpp"

namespace proxarm::controller {
namespace {

using fieldbus::PlannedBus;
using fieldbus::PlannedFrame;

std::int64_t period_ns(const PreparedSession& session) { return std::llround(session.settings.period_s * 1e9); }

// Returns the period, in cycles, of a frame that is sent every `ms` milliseconds.
int cycles_of(const PreparedSession& session, int ms) {
  return std::max(1, static_cast<int>(std::int64_t{ms} * 1'000'000 / period_ns(session)));
}

void add_sync(PlannedBus& bus) {
  PlannedFrame sync{.name = "SYNC", .id = fieldbus::sync_id};
  sync.shape.bytes = 0;
  sync.sender = "controller";
  sync.sync = true;
  bus.frames.push_back(sync);
}

// Adds the controller's heartbeat, which is queued after all setpoints.
void add_heartbeat(PlannedBus& bus, const PreparedSession& session) {
  fieldbus::DriveSettings drive;
  drive.stop_without_controller(session.cell.supervision.bus_loss_stop_s);
  PlannedFrame heartbeat{.name = "controller's heartbeat", .id = fieldbus::heartbeat_id(drive.master_node)};
  heartbeat.shape.bytes = 1;
  heartbeat.sender = "controller";
  heartbeat.release = session.cell.receive_window;
  heartbeat.every_cycles = cycles_of(session, drive.master_heartbeat_ms);
  heartbeat.deadline = cycles_of(session, drive.master_heartbeat_timeout_ms - drive.master_heartbeat_ms);
  bus.frames.push_back(heartbeat);
}

// Adds the frames of a drive's life guarding: the request without data, and the answer. The request is sent after each
// heartbeat.
void add_guarding(PlannedBus& bus, const PlannedFrame& heartbeat, const description::DriveDescription& drive) {
  if (drive.bring_up.stops_by != description::StopsBy::life_guarding) return;
  PlannedFrame frame = heartbeat;
  frame.id = fieldbus::heartbeat_id(drive.node);
  frame.name = "guard request to " + drive.joint;
  frame.shape.bytes = 0;
  bus.frames.push_back(frame);
  frame.after = frame.name;
  frame.name = "guard answer of " + drive.joint;
  frame.shape.bytes = 1;
  frame.sender = drive.joint;
  bus.frames.push_back(frame);
}

// Typical contents of frames: the drives are enabled and within 0.2 rad of the start pose, and a hand pushes with up to
// 10 N and 1 Nm along each axis.
constexpr int typical_samples = 256;
constexpr double typical_motion_rad = 0.2, typical_force_N = 10.0, typical_torque_Nm = 1.0;
// Time from a poll to the sensor's answer. Makers don't state it, so this is the time that simulated sensors take.
constexpr std::int64_t answer_time_ns = sim::DescribedDeviceConfig{}.answer_time_ns;
constexpr std::uint16_t typical_controlword = 0x000F, typical_statusword = 0x1237;

class TypicalPdos {
 public:
  TypicalPdos(const description::DriveDescription& drive, double start_rad)
      : drive_(drive), scale_(drive), start_rad_(start_rad) {}

  std::vector<fieldbus::CanFrame> operator()(std::uint32_t id, const std::vector<fieldbus::MappedObject>& mapping) {
    std::vector<fieldbus::CanFrame> frames(typical_samples);
    for (fieldbus::CanFrame& frame : frames) {
      frame.id = id;
      frame.fd = frame.bit_rate_switch = drive_.fd;
      for (const fieldbus::MappedObject& mapped : mapping) {
        std::array<std::uint8_t, 4> bytes{};
        fieldbus::write_u32_le(bytes.data(), value_of(mapped));
        std::copy_n(bytes.begin(), mapped.bits / 8, frame.data.begin() + frame.length);
        frame.length = static_cast<std::uint8_t>(frame.length + mapped.bits / 8);
      }
      frame.length = static_cast<std::uint8_t>(fieldbus::padded_length(frame.length, drive_.fd));
    }
    return frames;
  }

 private:
  std::uint32_t value_of(const fieldbus::MappedObject& mapped) {
    if (mapped.object == fieldbus::object_address(drive_.objects.controlword)) return typical_controlword;
    if (mapped.object == fieldbus::object_address(drive_.objects.statusword)) return typical_statusword;
    if (mapped.bits == 16) return static_cast<std::uint32_t>(std::lround(100.0 * around_(random_)));  // a torque
    // Some joints move far, others hardly, so the sizes of the motions have all orders of magnitude down to one count.
    const double reach_rad = typical_motion_rad * std::pow(10.0, -7.0 * std::abs(around_(random_)));
    return static_cast<std::uint32_t>(scale_.counts(start_rad_ + reach_rad * around_(random_)).value_or(0));
  }

  const description::DriveDescription& drive_;
  fieldbus::CountScale scale_;
  double start_rad_;
  std::mt19937 random_{1};
  std::uniform_real_distribution<double> around_{-1.0, 1.0};
};

// Makes the frames that a described sensor sends for samples of a random push.
class TypicalSensor final : private sim::WrenchSource, private sim::DevicePort {
 public:
  std::vector<fieldbus::CanFrame> operator()(const description::SensorDescription& sensor, std::uint32_t base_id) {
    sim::DescribedDevice device(sensor, {.base_id = base_id, .answer_time_ns = 0, .start_time_ns = 0}, *this, *this);
    device.power_on(0);
    const description::SensorProtocol& protocol = *sensor.described;
    for (const auto* command : {&protocol.start, &protocol.poll}) {
      if (!*command) continue;
      fieldbus::CanFrame frame;
      frame.id = (*command)->id + base_id * protocol.base_id_step;
      frame.extended = protocol.extended;
      frame.fd = protocol.fd;
      frame.length = static_cast<std::uint8_t>(std::min<std::size_t>((*command)->data.size(), 8));
      std::copy_n((*command)->data.begin(), frame.length, frame.data.begin());
      for (int i = 0; i < (command == &protocol.poll ? typical_samples : 1); ++i) device.on_frame(frame, 1);
    }
    for (int i = 0; protocol.streams() && i < typical_samples; ++i) device.on_converter(1);
    return frames_;
  }

 private:
  std::array<double, 6> wrench(std::int64_t) noexcept override {
    std::array<double, 6> load{};
    for (std::size_t i = 0; i < 6; ++i) load[i] = (i < 3 ? typical_force_N : typical_torque_Nm) * around_(random_);
    return load;
  }
  void send(const fieldbus::CanFrame& frame, std::int64_t) noexcept override { frames_.push_back(frame); }

  std::vector<fieldbus::CanFrame> frames_;
  std::mt19937 random_{1};
  std::uniform_real_distribution<double> around_{-1.0, 1.0};
};

void add_drive(PlannedBus& bus, const PreparedSession& session, std::size_t axis) {
  const description::DriveDescription& drive = session.cell.drives[axis];
  const std::uint8_t node = drive.node;
  TypicalPdos typical(drive, session.cell.start_rad[axis]);
  PlannedFrame feedback{.name = drive.joint + " TPDO1",
                        .id = fieldbus::pdo_id(fieldbus::PdoDirection::transmit, 1, node)};
  feedback.shape.bytes = fieldbus::padded_length(fieldbus::pdo_bytes(fieldbus::tpdo_mapping(drive)), drive.fd);
  feedback.shape.fd = feedback.shape.bit_rate_switch = drive.fd;
  feedback.typical = typical(feedback.id, fieldbus::tpdo_mapping(drive));
  feedback.sender = drive.joint;
  feedback.after = "SYNC";
  PlannedFrame target{.name = drive.joint + " RPDO1", .id = fieldbus::pdo_id(fieldbus::PdoDirection::receive, 1, node)};
  target.shape.bytes = fieldbus::pdo_bytes(fieldbus::rpdo_mapping(drive));
  target.shape.fd = target.shape.bit_rate_switch = drive.fd;
  target.typical = typical(target.id, fieldbus::rpdo_mapping(drive));
  target.sender = "controller";
  target.release = session.cell.receive_window;
  for (const PlannedFrame& frame : {feedback, target}) bus.frames.push_back(frame);
}

// Returns frames with typical gauges. A frame's last six bytes hold the gauges `first`, `first` + 2 and `first` + 4,
// each with its bias plus a random push and noise.
std::vector<fieldbus::CanFrame> typical_gauges(const PreparedSession& session, PlannedFrame frame, std::size_t first) {
  std::mt19937 random(1);
  std::uniform_int_distribution<int> around(-500, 500);
  std::vector<fieldbus::CanFrame> frames(typical_samples);
  for (fieldbus::CanFrame& made : frames) {
    made.id = frame.id;
    made.length = static_cast<std::uint8_t>(frame.shape.bytes);
    const std::size_t at = made.length - 6U;
    for (std::size_t i = 0; i < 3; ++i) {
      const double bias = session.sensor.simulation.bias_counts[first + 2 * i];
      const auto gauge = static_cast<std::uint16_t>(std::lround(bias) + around(random));
      made.data[at + 2 * i] = static_cast<std::uint8_t>(gauge >> 8);
      made.data[at + 2 * i + 1] = static_cast<std::uint8_t>(gauge);
    }
  }
  return frames;
}

// Adds the frame of the enabling input. The frame is TPDO2 of the input's drive, or a message that is sent at least
// twice within timeout_s.
void add_enabling_input(PlannedBus& bus, const PreparedSession& session) {
  const description::EnablingInputDescription& input = *session.cell.enabling_input;
  PlannedFrame frame{.name = "enabling input", .id = input.identifier};
  if (!input.drive.empty()) {
    const auto& drives = session.cell.drives;
    const auto drive =
        std::find_if(drives.begin(), drives.end(), [&](const auto& d) { return d.joint == input.drive; });
    frame.id = fieldbus::pdo_id(fieldbus::PdoDirection::transmit, 2, drive->node);
    frame.shape.bytes = 4;
    frame.sender = input.drive;
    frame.after = input.drive + " TPDO1";
  } else {
    frame.shape.bytes = 8;
    frame.shape.extended = input.extended;
    frame.sender = "enabling input";
    frame.any_time = true;
    frame.every_cycles = cycles_of(session, std::max(1, static_cast<int>(500.0 * input.timeout_s)));
  }
  // Typical content: the switch is pressed, and all other bits are 0.
  fieldbus::CanFrame usual;
  usual.id = frame.id;
  usual.extended = frame.shape.extended;
  usual.length = static_cast<std::uint8_t>(frame.shape.bytes);
  const auto byte = static_cast<std::size_t>(input.drive.empty() ? input.byte : input.bit / 8);
  if (input.pressed_is) usual.data[byte] = static_cast<std::uint8_t>(1U << (input.bit % 8));
  frame.typical = {usual};
  bus.frames.push_back(frame);
}

// Adds the frames of an ATI Net CAN OEM sensor: a poll and two answers.
void add_sensor(PlannedBus& bus, const PreparedSession& session) {
  const std::uint32_t base = session.cell.sensor.base_id << 4;
  PlannedFrame poll{.name = "sensor poll", .id = base};
  poll.shape.bytes = 0;
  poll.sender = "controller";
  PlannedFrame first{.name = "sensor gauges 0 2 4", .id = base};
  first.shape.bytes = 8;
  first.sender = "sensor";
  first.after = "sensor poll";
  first.latest_delay_ns = answer_time_ns;
  first.deadline = session.cell.receive_window;
  PlannedFrame second{.name = "sensor gauges 1 3 5", .id = base | 1U};
  second.shape.bytes = 6;
  second.sender = "sensor";
  second.after = "sensor poll";
  second.latest_delay_ns = answer_time_ns;
  second.deadline = session.cell.receive_window;
  first.typical = typical_gauges(session, first, 0);
  second.typical = typical_gauges(session, second, 1);
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

// Adds the frames of a described sensor. A polled sensor must answer within the receive window. A streaming sensor
// sends by its own clock, independent of the timestep. The frames of one sample follow one another.
void add_described_sensor(PlannedBus& bus, const PreparedSession& session) {
  const description::SensorProtocol& protocol = *session.sensor.described;
  const std::uint32_t base_id = session.cell.sensor.base_id;
  std::string before;
  const std::vector<fieldbus::CanFrame> typical = TypicalSensor{}(session.sensor, base_id);
  if (protocol.poll) {
    PlannedFrame poll =
        described_frame(protocol, protocol.wire_id(protocol.poll->id, base_id), protocol.poll->data.size());
    poll.name = before = "sensor poll";
    poll.sender = "controller";
    bus.frames.push_back(poll);
  }
  for (std::size_t i = 0; i < protocol.frames.size(); ++i) {
    PlannedFrame frame =
        described_frame(protocol, protocol.wire_id(protocol.frames[i].id, base_id), protocol.frames[i].bytes);
    frame.name = "sensor frame " + std::to_string(i + 1);
    frame.any_time = protocol.streams() && before.empty();
    frame.after = before;
    if (protocol.poll && i == 0) frame.latest_delay_ns = answer_time_ns;
    if (protocol.streams()) frame.every_ns = std::llround(1e9 / protocol.rate_Hz);
    if (protocol.poll) frame.deadline = session.cell.receive_window;
    std::copy_if(typical.begin(), typical.end(), std::back_inserter(frame.typical),
                 [&](const fieldbus::CanFrame& f) { return f.id == frame.id && f.length == frame.shape.bytes; });
    before = frame.name;
    bus.frames.push_back(frame);
  }
}

PlannedBus planned(const PreparedSession& session, const BusIndices& indices, std::size_t index) {
  PlannedBus bus;
  bus.bitrate = 0;
  for (std::size_t i = 0; i < session.cell.buses.size(); ++i) {
    if (indices[i] != index) continue;
    const description::BusDescription& own = session.cell.buses[i];
    bus.name += (bus.name.empty() ? "" : "+") + own.name;
    // Buses that share an interface get the lowest of their bitrates. If one of these buses is classic CAN, its data
    // bitrate of 0 makes the interface classic.
    bus.data_bitrate = bus.bitrate == 0 ? own.data_bitrate : std::min(bus.data_bitrate, own.data_bitrate);
    bus.bitrate = bus.bitrate == 0 ? own.bitrate : std::min(bus.bitrate, own.bitrate);
    const auto on_it = [&](const description::DriveDescription& d) { return d.bus == own.name; };
    const bool first_drives =
        std::none_of(bus.frames.begin(), bus.frames.end(), [](const PlannedFrame& f) { return f.sync; });
    if (first_drives && std::any_of(session.cell.drives.begin(), session.cell.drives.end(), on_it)) {
      add_sync(bus);
    }
    for (std::size_t axis = 0; axis < session.cell.drives.size(); ++axis) {
      if (on_it(session.cell.drives[axis])) add_drive(bus, session, axis);
    }
    const auto& enabling = session.cell.enabling_input;
    if (enabling && enabling->bus == own.name && !session.settings.without_enabling_input) {
      add_enabling_input(bus, session);
    }
    if (session.cell.sensor.bus != own.name) continue;
    if (session.sensor.described) {
      add_described_sensor(bus, session);
    } else {
      add_sensor(bus, session);
    }
  }
  const bool drives = std::any_of(bus.frames.begin(), bus.frames.end(), [](const PlannedFrame& f) { return f.sync; });
  if (!drives) return bus;
  add_heartbeat(bus, session);
  const PlannedFrame heartbeat = bus.frames.back();
  for (const description::DriveDescription& drive : session.cell.drives) {
    for (std::size_t i = 0; i < session.cell.buses.size(); ++i) {
      if (indices[i] == index && session.cell.buses[i].name == drive.bus) add_guarding(bus, heartbeat, drive);
    }
  }
  return bus;
}

// ---- Finding keys of the cell with which the frames of a late sensor would arrive in time

// Plans one bus of the network for any variant of a session.
class PlaceOfBus {
 public:
  PlaceOfBus(const BusIndices& indices, std::size_t index) : indices_(indices), index_(index) {}

  [[nodiscard]] fieldbus::BusPlan plan(const PreparedSession& session) const {
    return fieldbus::plan_bus(planned(session, indices_, index_), period_ns(session));
  }
  [[nodiscard]] bool has_sensor(const description::Cell& cell) const {
    for (std::size_t i = 0; i < cell.buses.size(); ++i) {
      if (cell.buses[i].name == cell.sensor.bus) return indices_[i] == index_;
    }
    return false;
  }
  [[nodiscard]] bool has_own_identifiers(const PreparedSession& session) const {
    try {
      require_own_identifiers(session.cell, session.sensor, session.settings, indices_);
    } catch (const description::SetupError&) {
      return false;
    }
    return true;
  }

 private:
  const BusIndices& indices_;
  std::size_t index_;
};

// Returns the largest free base_id below the sensor's present one with which all frames arrive in time. Returns nullopt
// if there is none, or if the sensor has no base id.
std::optional<std::uint32_t> lower_base_id(PreparedSession session, const PlaceOfBus& place) {
  constexpr std::uint32_t tries = 128;  // the number of an ATI sensor's base ids
  if (session.sensor.described && !session.sensor.described->has_base_id) return std::nullopt;
  const std::uint32_t least = session.sensor.described ? session.sensor.described->base_id_min : 0;
  std::uint32_t& base_id = session.cell.sensor.base_id;
  for (std::uint32_t n = 0; n < tries && base_id > least; ++n) {
    --base_id;
    if (place.has_own_identifiers(session) && place.plan(session).fits) return base_id;
  }
  return std::nullopt;
}

// Returns the shortest receive_window above the session's with which all frames arrive in time; nullopt if there is
// none. Tries multiples of a twentieth of the timestep.
std::optional<double> longer_window(PreparedSession session, const PlaceOfBus& place) {
  constexpr int steps = 20, longest = 16;  // the key's range ends at 0.8
  for (int n = 1; n <= longest; ++n) {
    const double window = static_cast<double>(n) / steps;
    if (window <= session.settings.receive_window) continue;
    session.cell.receive_window = session.settings.receive_window = window;
    if (place.plan(session).fits) return window;
  }
  return std::nullopt;
}

// Adds a lower base_id and a longer receive_window to the plan's remedies, if all frames fit into the cycle but some
// arrive too late.
void add_ways_of_the_cell(const PreparedSession& session, const PlaceOfBus& place, fieldbus::BusPlan& plan) {
  if (plan.fits || plan.worst_ns > plan.period_ns || !place.has_sensor(session.cell)) return;
  std::vector<std::string> ways;
  if (const auto base_id = lower_base_id(session, place)) {
    ways.push_back("sensor.base_id: " + fieldbus::hex_text(*base_id, 2) + " (lower identifiers win)");
  }
  if (const auto window = longer_window(session, place)) {
    ways.push_back("receive_window: " + description::rounded_text(*window));
  }
  plan.alternatives.insert(plan.alternatives.begin(), ways.begin(), ways.end());
}

void require_within(const std::vector<fieldbus::BusPlan>& plans, const description::Cell& cell,
                    const RunOptions& options) {
  const std::string refusal = fieldbus::refusal_text(plans);
  if (refusal.empty()) return;
  description::SetupProblem problem = timestep_problem(cell, options);
  problem.message = refusal;
  problem.advice = "`proxarm plan` shows each frame";
  throw description::SetupError(problem);
}

}  // namespace

std::vector<fieldbus::BusPlan> plan_buses(const PreparedSession& session, const BusIndices& indices) {
  std::vector<fieldbus::BusPlan> plans;
  const std::size_t buses = indices.empty() ? 0 : *std::max_element(indices.begin(), indices.end()) + 1;
  for (std::size_t index = 0; index < buses; ++index) {
    const PlaceOfBus place(indices, index);
    plans.push_back(place.plan(session));
    add_ways_of_the_cell(session, place, plans.back());
  }
  return plans;
}

bool is_carried(const PreparedSession& session) {
  return fieldbus::refusal_text(plan_buses(session, buses_in_order(session.cell))).empty();
}

void require_carried(const PreparedSession& session, const RunOptions& options) {
  if (!options.bus.simulated()) {
    return require_carried_on(options.bus.interfaces(bus_names(session.cell)), session, options);
  }
  require_within(plan_buses(session, buses_in_order(session.cell)), session.cell, options);
}

bool is_virtual_interface(const std::string& interface) { return fieldbus::is_virtual_can(interface); }

void require_carried_on(const std::vector<std::string>& interfaces, const PreparedSession& session,
                        const RunOptions& options, const IsVirtual& is_virtual) {
  const BusIndices indices = indices_of(interfaces);
  const std::vector<fieldbus::BusPlan> plans = plan_buses(session, indices);
  std::vector<fieldbus::BusPlan> real, virtual_ones;
  for (std::size_t wire = 0; wire < plans.size(); ++wire) {
    const auto first = std::find(indices.begin(), indices.end(), wire);
    const std::string& interface = interfaces[static_cast<std::size_t>(first - indices.begin())];
    (is_virtual(interface) ? virtual_ones : real).push_back(plans[wire]);
  }
  require_within(real, session.cell, options);
  const std::string refusal = fieldbus::refusal_text(virtual_ones);
  if (refusal.empty()) return;
  std::fprintf(stderr, "proxarm: on a real bus this would be refused (a virtual one has no bit timing): %s\n",
               refusal.c_str());
}

}  // namespace proxarm::controller
