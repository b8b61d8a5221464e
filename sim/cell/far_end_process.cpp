#include "sim/cell/far_end_process.hpp"

#include <algorithm>
#include <cstdio>
#include <string>
#include <utility>

#include "fieldbus/can/socket_can_network.hpp"
#include "models/base/setup_error.hpp"

namespace proxarm::sim {

namespace {

using description::SetupError;

constexpr std::int64_t longest_sleep = 20'000'000;  // limits how late the stop flag is noticed

// True for the identifiers of the predefined connection set that this drive uses, and for identifiers that all drives
// use (node 0).
bool is_used_by(std::uint8_t node, std::uint32_t id) noexcept {
  const std::uint32_t base = id & 0x780, number = id & 0x7F;
  if (number == 0) return base == 0x000 || base == 0x080;
  return number == node && base != 0x000 && base != 0x100 && base != 0x680 && base != 0x780;
}

std::vector<std::uint32_t> sensor_ids(const description::Cell& cell, const description::SensorDescription& sensor) {
  std::vector<std::uint32_t> ids;
  if (sensor.described && !sensor.described->on_can()) return ids;
  if (sensor.described && !sensor.described->extended) return sensor.described->wire_ids(cell.sensor.base_id);
  if (sensor.described) return ids;  // 29-bit identifiers can't collide with a drive's
  for (std::uint32_t operation = 0; operation < 16; ++operation) ids.push_back(cell.sensor.base_id << 4 | operation);
  return ids;
}

// Throws SetupError if two drives on one interface have the same node number, because both would answer each request.
void check_nodes(const description::Cell& cell, const description::SensorDescription& sensor,
                 const std::vector<std::size_t>& interface_of_bus) {
  if (interface_of_bus.size() != cell.buses.size()) {
    throw SetupError({.file = cell.file.string(),
                      .key = "buses",
                      .found = std::to_string(interface_of_bus.size()) + " interfaces",
                      .expected = "one for each of " + std::to_string(cell.buses.size()) + " buses"});
  }
  const auto interface_of = [&](const std::string& name) {
    for (std::size_t i = 0; i < cell.buses.size(); ++i) {
      if (cell.buses[i].name == name) return interface_of_bus[i];
    }
    return std::numeric_limits<std::size_t>::max();
  };
  for (std::size_t i = 0; i < cell.drives.size(); ++i) {
    if (!cell.drives[i].on_can()) continue;
    const bool with_sensor = interface_of(cell.drives[i].bus) == interface_of(cell.sensor.bus);
    for (const std::uint32_t id : sensor_ids(cell, sensor)) {
      if (!with_sensor || !is_used_by(cell.drives[i].node, id)) continue;
      char text[8];
      std::snprintf(text, sizeof text, "0x%03X", id);
      throw SetupError({.file = cell.file.string(),
                        .bus = cell.sensor.bus,
                        .node = cell.drives[i].node,
                        .key = sensor.described && !sensor.described->has_base_id ? "sensor.bus" : "sensor.base_id",
                        .message = std::string("identifier ") + text + " would be the sensor's and, on the same " +
                                   "interface, that of the drive of " + cell.drives[i].joint});
    }
    for (std::size_t j = 0; j < i; ++j) {
      const bool same_wire =
          cell.drives[j].on_can() && interface_of(cell.drives[i].bus) == interface_of(cell.drives[j].bus);
      if (!same_wire || cell.drives[i].node != cell.drives[j].node) continue;
      throw SetupError({.file = cell.file.string(),
                        .bus = cell.drives[i].bus,
                        .node = cell.drives[i].node,
                        .key = "drives[" + std::to_string(i) + "].node",
                        .message = "drives of " + cell.drives[j].joint + " and " + cell.drives[i].joint +
                                   " have the same node on one interface"});
    }
  }
}

}  // namespace

class FarEndProcess::InterfacePort final : public fieldbus::CanPort {
 public:
  explicit InterfacePort(fieldbus::CanBus& bus) : bus_(bus) {}
  fieldbus::SendResult send(const fieldbus::CanFrame& frame) noexcept override { return bus_.send(frame); }

 private:
  fieldbus::CanBus& bus_;
};

FarEndProcess::FarEndProcess(const description::Cell& cell, const description::SensorDescription& sensor,
                             const description::HandDescription& hand, fieldbus::CanNetwork& network,
                             const std::vector<std::size_t>& interface_of_bus, const SimulatedCellConfig& config)
    : network_(network), events_(network.now_ns()), interface_of_bus_(interface_of_bus), tick_ns_(config.tick_ns) {
  check_nodes(cell, sensor, interface_of_bus);
  cell_ = std::make_unique<SimulatedCell>(cell, sensor, hand, events_, config);
  for (std::size_t i = 0; i < cell_->node_count(); ++i) {
    DeviceNode& node = cell_->node(i);
    ports_.push_back(std::make_unique<InterfacePort>(network.bus(interface_of_bus_[node.bus()])));
    node.connect(*ports_.back());
  }
}

FarEndProcess::~FarEndProcess() = default;

void FarEndProcess::run(const std::atomic<bool>& stop, std::int64_t until_ns) {
  if (!powered_) {
    events_.advance_to(network_.now_ns());
    cell_->power_on();
    powered_ = true;
  }
  // Read the clock only once per round: if reading it is a system call, that call takes most of the round.
  for (std::int64_t now_ns = network_.now_ns(); now_ns < until_ns && !stop.load(std::memory_order_relaxed);) {
    network_.wait_for_frame(std::min({events_.next_time(), until_ns, now_ns + longest_sleep}));
    ++statistics_.wake_ups;
    now_ns = network_.now_ns();
    receive_all(now_ns);
    run_events(now_ns);
  }
}

void FarEndProcess::receive_all(std::int64_t now_ns) {
  for (std::size_t interface = 0; interface < network_.bus_count(); ++interface) {
    for (fieldbus::TimedFrame timed; network_.bus(interface).receive(timed);) deliver(interface, timed, now_ns);
  }
}

// Delivers a frame to the nodes of its interface, after the events that were due before the frame. A time stamp later
// than now_ns or earlier than the time already simulated is corrected to that time.
void FarEndProcess::deliver(std::size_t interface, const fieldbus::TimedFrame& timed, std::int64_t now_ns) {
  ++statistics_.frames_received;
  const std::int64_t time_ns = std::max(std::min(timed.time_ns, now_ns), events_.now_ns());
  events_.run_until(time_ns);
  for (std::size_t i = 0; i < cell_->node_count(); ++i) {
    DeviceNode& node = cell_->node(i);
    if (interface_of_bus_[node.bus()] == interface) node.on_frame(timed.frame, time_ns);
  }
}

void FarEndProcess::run_events(std::int64_t now_ns) {
  const std::int64_t due_ns = events_.next_time();
  if (due_ns > now_ns) return;
  const std::int64_t late_ns = now_ns - due_ns;
  if (late_ns > tick_ns_) ++statistics_.late_wake_ups;
  statistics_.latest_wake_up_ns = std::max(statistics_.latest_wake_up_ns, late_ns);
  events_.run_until(now_ns);
}

FarEndStatistics FarEndProcess::statistics() const {
  FarEndStatistics total = statistics_;
  for (std::size_t i = 0; i < cell_->node_count(); ++i) {
    total.frames_sent += cell_->node(i).frames_sent();
    total.frames_not_sent += cell_->node(i).frames_not_sent();
  }
  for (std::size_t i = 0; i < network_.bus_count(); ++i)
    total.frames_lost += network_.bus(i).status().receive_overflows;
  return total;
}

void set_acceptance_filters(fieldbus::SocketCanNetwork& network, const description::Cell& cell,
                            const description::SensorDescription& sensor,
                            const std::vector<std::size_t>& interface_of_bus) {
  std::vector<std::vector<fieldbus::CanFilter>> filters(network.bus_count());
  const auto filters_of = [&](const std::string& bus) -> std::vector<fieldbus::CanFilter>& {
    std::size_t at = 0;
    while (cell.buses[at].name != bus) ++at;
    return filters[interface_of_bus[at]];
  };
  for (const description::DriveDescription& drive : cell.drives) {
    if (!drive.on_can()) continue;
    auto& own = filters_of(drive.bus);
    own.push_back({.id = drive.node, .mask = 0x07F});
    for (const std::uint32_t id : {0x000U, 0x080U}) own.push_back({.id = id, .mask = 0x7FF});
    own.push_back({.id = 0x700, .mask = 0x780});
  }
  if (!sensor.described) {
    filters_of(cell.sensor.bus).push_back({.id = cell.sensor.base_id << 4, .mask = 0x7F0});
  } else if (sensor.described->on_can()) {
    for (const std::uint32_t id : sensor.described->wire_ids(cell.sensor.base_id)) {
      filters_of(cell.sensor.bus).push_back({.id = id, .extended = sensor.described->extended});
    }
  }
  for (std::size_t bus = 0; bus < filters.size(); ++bus) network.set_filters(bus, filters[bus]);
}

FarEndStatistics run_on_socketcan(const description::Cell& cell, const description::SensorDescription& sensor,
                                  const description::HandDescription& hand, const std::vector<std::string>& interfaces,
                                  const std::atomic<bool>& stop, const SimulatedCellConfig& config) {
  fieldbus::SocketCanNetwork network(interfaces, {.closed = true});
  std::vector<std::size_t> interface_of_bus;
  for (std::size_t i = 0; i < interfaces.size(); ++i) interface_of_bus.push_back(network.bus_of(i));
  set_acceptance_filters(network, cell, sensor, interface_of_bus);
  FarEndProcess process(cell, sensor, hand, network, interface_of_bus, config);
  process.run(stop);
  return process.statistics();
}

}  // namespace proxarm::sim
