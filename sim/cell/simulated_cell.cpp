#include "sim/cell/simulated_cell.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "models/base/setup_error.hpp"
#include "models/description/homing.hpp"
#include "models/files/eds_file.hpp"
#include "sim/cell/plant_axis.hpp"

namespace proxarm::sim {

namespace {

using description::SetupError;

// Factory setting of the following error window (6065h), in radians at the joint. The master may change it.
constexpr double following_error_window_rad = 0.05;

double counts_per_rad(const description::DriveDescription& drive) noexcept { return std::abs(drive.counts_per_rad()); }

std::uint32_t to_u32(double value) noexcept {
  return static_cast<std::uint32_t>(std::clamp(std::nearbyint(value), 1.0, 4294967294.0));
}

std::int32_t to_i32(double value) noexcept {
  return static_cast<std::int32_t>(std::clamp(std::nearbyint(value), -2147483648.0, 2147483647.0));
}

// Takes the drive's identity from the maker's file: from [DeviceInfo], or else from the defaults of 1018h.
void take_identity(const description::EdsFile& eds, CanopenSlaveConfig& canopen) {
  const auto number = [&eds](std::optional<std::uint32_t> of_device, std::uint32_t object) -> std::uint32_t {
    const description::EdsObject* there = eds.find(object);
    return of_device.value_or(there == nullptr ? 0 : there->default_value.value_or(0));
  };
  canopen.vendor = number(eds.vendor, 0x101801);
  canopen.product = number(eds.product, 0x101802);
  canopen.revision = number(eds.revision, 0x101803);
}

StackBehaviour stack_of(const std::string& name) {
  constexpr std::pair<const char*, StackBehaviour> stacks[] = {{"latching", StackBehaviour::latching},
                                                               {"lazy", StackBehaviour::lazy},
                                                               {"holding", StackBehaviour::holding},
                                                               {"insisting", StackBehaviour::insisting}};
  for (const auto& [known, stack] : stacks) {
    if (name == known) return stack;
  }
  return StackBehaviour::strict;
}

DriveDeviceConfig drive_config(const description::DriveDescription& drive, const description::EdsFile* eds,
                               const SimulatedCellConfig& config) {
  DriveDeviceConfig c;
  c.canopen.node = drive.node;
  c.canopen.fd = drive.fd;
  constexpr std::uint32_t servo_drive = 0x00020192;  // value of 1000h
  const description::EdsObject* type = eds == nullptr ? nullptr : eds->find(0x100000);
  c.canopen.device_type =
      drive.device_type.value_or(type == nullptr ? servo_drive : type->default_value.value_or(servo_drive));
  c.canopen.serial = drive.node;
  c.canopen.stack = stack_of(drive.simulation.stack);
  c.canopen.revision = 0x00010000;
  c.canopen.device_name = "simulated drive of " + drive.joint;
  c.canopen.boot_time_ns = config.drive_boot_time_ns;
  if (eds != nullptr) take_identity(*eds, c.canopen);
  c.eds = eds;
  c.objects = drive.objects;
  c.gear_torque = drive.gear_torque;
  if (const std::uint32_t target = drive.objects.target; target != 0) {
    (drive.mode == "ip" ? c.interpolated_target : drive.mode == "cst" ? c.torque_target : c.position_target) = target;
  }
  const double scale = counts_per_rad(drive);
  c.following_error_window_counts = to_u32(following_error_window_rad * scale);
  c.quick_stop_deceleration = to_u32(drive.max_acceleration_rad_per_s2 * scale);
  c.profile_deceleration = to_u32(0.5 * drive.max_acceleration_rad_per_s2 * scale);
  const double first = drive.offset_counts + drive.range_rad[0] * drive.counts_per_rad();
  const double second = drive.offset_counts + drive.range_rad[1] * drive.counts_per_rad();
  c.position_min = to_i32(std::min(first, second));
  c.position_max = to_i32(std::max(first, second));
  c.brake_release_ns = config.brake_release_ns;
  if (drive.simulation.brake_release_s) c.brake_release_ns = std::llround(1e9 * *drive.simulation.brake_release_s);
  if (drive.homing) {
    const double home = drive.offset_counts + drive.homing->angle_rad * drive.counts_per_rad();
    c.incremental = {.home_counts = to_i32(home)};
    c.position_min = to_i32(std::min(first, second) - home);  // relative to the drive's zero after homing
    c.position_max = to_i32(std::max(first, second) - home);
  }
  const double rated_Nm = drive.rated_torque_Nm > 0.0 ? drive.rated_torque_Nm : drive.simulation.max_torque_Nm;
  c.rated_torque_mNm = to_u32(1e3 * rated_Nm / drive.gear_ratio);
  return c;
}

// Applies faults of objects: an object is missing or read-only, has another value, or refuses a value.
void make_otherwise(const DeviceFault& fault, ObjectDictionary& dictionary) {
  constexpr DeviceFaultKind of_objects[] = {DeviceFaultKind::object_missing, DeviceFaultKind::object_fixed,
                                            DeviceFaultKind::object_holds, DeviceFaultKind::value_refused};
  if (std::find(std::begin(of_objects), std::end(of_objects), fault.kind) == std::end(of_objects)) return;
  ObjectEntry* entry =
      dictionary.find(static_cast<std::uint16_t>(fault.value >> 8), static_cast<std::uint8_t>(fault.value));
  if (entry == nullptr) {
    throw SetupError({.key = "--fault",
                      .found = "an object that the simulated drive of " + fault.device + " hasn't",
                      .expected = "index and sub-index of one that it has, such as 0x600700"});
  }
  switch (fault.kind) {
    case DeviceFaultKind::object_missing:
      entry->hidden = true;
      return;
    case DeviceFaultKind::object_holds:
      entry->set(fault.content);
      entry->default_value = entry->value;
      return;
    case DeviceFaultKind::value_refused:
      entry->before_write = [code = static_cast<SdoAbort>(fault.content)](std::int64_t) { return code; };
      return;
    default:
      entry->access = Access::read_only;
  }
}

// Makes the drive refuse mapped objects until a mode is set.
void map_only_in_a_mode(ObjectDictionary& dictionary) {
  constexpr std::uint16_t mappings[] = {0x1600, 0x1A00};
  for (const std::uint16_t mapping : mappings) {
    ObjectEntry& entry = dictionary.at(mapping, 1);
    entry.before_write = [&dictionary, before = entry.before_write](std::int64_t value) {
      if (dictionary.number(0x6060) == 0) return SdoAbort::not_in_present_device_state;
      return before ? before(value) : SdoAbort::none;
    };
  }
}

}  // namespace

std::vector<fieldbus::SimulatedBusConfig> simulated_buses(const description::Cell& cell) {
  std::vector<fieldbus::SimulatedBusConfig> buses;
  for (const description::BusDescription& bus : cell.buses) {
    fieldbus::SimulatedBusConfig config;
    config.name = bus.name;
    config.bitrate = bus.bitrate;
    config.data_bitrate = bus.data_bitrate;
    buses.push_back(config);
  }
  return buses;
}

// ---- How devices access the physics

class SimulatedCell::PlantGauges final : public GaugeSource {
 public:
  explicit PlantGauges(const Plant& plant) : plant_(plant) {}
  [[nodiscard]] std::array<std::int16_t, 6> gauges(std::int64_t time_ns) noexcept override {
    return plant_.force_sensor().sample(time_ns).gauges;
  }

 private:
  const Plant& plant_;
};

class SimulatedCell::WirelessModbus final : public fieldbus::ModbusClient {
 public:
  explicit WirelessModbus(std::vector<ModbusUnit*> devices) : devices_(std::move(devices)) {}

 private:
  fieldbus::ModbusResult transact(const fieldbus::ModbusMessage& request,
                                  fieldbus::ModbusMessage& answer) noexcept override {
    for (ModbusUnit* device : devices_) {
      if (device->unit() != request.bytes[0]) continue;
      if (device->fault() == ModbusFault::closed) return fieldbus::ModbusResult::closed;
      const std::vector<std::uint8_t> bytes = device->serve(request.span());
      // If only half an answer comes, the master waits for the rest until its timeout.
      if (bytes.empty() || device->fault() == ModbusFault::half) return fieldbus::ModbusResult::timeout;
      std::copy(bytes.begin(), bytes.end(), answer.bytes.begin());
      answer.size = bytes.size();
      return fieldbus::ModbusResult::ok;
    }
    return fieldbus::ModbusResult::timeout;
  }

  std::vector<ModbusUnit*> devices_;
};

class SimulatedCell::PlantWrench final : public WrenchSource {
 public:
  explicit PlantWrench(const Plant& plant) : plant_(plant) {}
  [[nodiscard]] std::array<double, 6> wrench(std::int64_t time_ns) noexcept override {
    return plant_.force_sensor().wrench(time_ns);
  }

 private:
  const Plant& plant_;
};

// ---- Set-up

SimulatedCell::SimulatedCell(const description::Cell& cell, const description::SensorDescription& sensor,
                             const description::HandDescription& hand, fieldbus::EventQueue& events,
                             const SimulatedCellConfig& config)
    : cell_(cell),
      events_(events),
      tick_ns_(config.tick_ns),
      faults_(config.faults),
      plant_(cell, sensor, hand, events.now_ns(), config.plant) {
  for (std::size_t axis = 0; axis < cell_.drives.size(); ++axis) {
    axes_.push_back(std::make_unique<PlantAxis>(plant_, axis, cell_.drives[axis]));
    drives_.emplace_back();
    modbus_drives_.emplace_back();
    node_of_axis_.push_back(nodes_.size());
    if (cell_.drives[axis].on_can()) {
      add_drive(axis, config);
    } else {
      add_modbus_drive(axis);
    }
  }
  add_enabling(config.enabling);
  add_sensor(sensor);
  if (config.helps_to_prove) helper_.emplace(plant_);
  check_faults(sensor);
}

SimulatedCell::~SimulatedCell() = default;

void SimulatedCell::add_drive(std::size_t axis, const SimulatedCellConfig& config) {
  const description::DriveDescription& drive = cell_.drives[axis];
  const std::size_t bus = bus_index(drive.bus, "drives[" + std::to_string(axis) + "].bus");
  std::optional<description::EdsFile> eds;
  if (!drive.eds.empty()) eds = description::load_eds(drive.eds);
  DriveDeviceConfig device = drive_config(drive, eds ? &*eds : nullptr, config);
  for (const DeviceFault& fault : faults_) {
    if (fault.device == drive.joint && fault.kind == DeviceFaultKind::device_type) {
      device.canopen.device_type = fault.value;
    }
  }
  const bool homed = std::any_of(faults_.begin(), faults_.end(), [&](const DeviceFault& fault) {
    return fault.device == drive.joint && fault.kind == DeviceFaultKind::homed;
  });
  if (homed && !drive.homing) {
    throw SetupError({.key = "--fault",
                      .found = "homed for " + drive.joint + ", whose encoder is absolute",
                      .expected = "a drive with `encoder: incremental`"});
  }
  if (homed) device.incremental->homed = true;
  Clockwork& clockwork = *this;
  nodes_.push_back(std::make_unique<DeviceNode>(drive.joint, bus, events_, clockwork));
  drives_[axis] = std::make_unique<DriveDevice>(device, *axes_[axis], *nodes_.back());
  nodes_.back()->set_device(*drives_[axis]);
  if (homed) {
    ObjectEntry& token =
        drives_[axis]->canopen().dictionary().at(description::homed_index, description::homed_subindex);
    token.set(description::homed_token(drive));
    token.default_value = token.value;
  }
  for (const DeviceFault& fault : faults_) {
    if (fault.device != drive.joint) continue;
    make_otherwise(fault, drives_[axis]->canopen().dictionary());
    if (fault.kind == DeviceFaultKind::mode_late) drives_[axis]->show_mode_late(true);
    if (fault.kind == DeviceFaultKind::mode_first) map_only_in_a_mode(drives_[axis]->canopen().dictionary());
    if (fault.kind == DeviceFaultKind::bits_wanted) {
      drives_[axis]->want_controlword_bits(static_cast<std::uint16_t>(fault.value));
    }
  }
}

// Adds the enabling switch. It is either wired to a drive's inputs or a node of its own that sends a message.
void SimulatedCell::add_enabling(const std::vector<PressedSpan>& spans) {
  if (!cell_.enabling_input) return;
  const description::EnablingInputDescription& input = *cell_.enabling_input;
  enabling_axis_ = axis_of(input.drive);
  if (!input.drive.empty()) {
    enabling_ = std::make_unique<EnablingSwitch>(input, spans, nullptr);
    return;
  }
  Clockwork& clockwork = *this;
  nodes_.push_back(
      std::make_unique<DeviceNode>("enabling input", bus_index(input.bus, "enabling_input.bus"), events_, clockwork));
  enabling_ = std::make_unique<EnablingSwitch>(input, spans, nodes_.back().get());
  nodes_.back()->set_device(*enabling_);
}

void SimulatedCell::seen(const fieldbus::CanFrame& frame, std::int64_t time_ns) noexcept {
  constexpr std::uint32_t sync = 0x080;
  if (enabling_ && frame.id == sync && !frame.extended) enabling_->on_sync(time_ns);
}

void SimulatedCell::press(std::int64_t time_ns) noexcept {
  if (!enabling_ || enabling_axis_ >= drives_.size() || !drives_[enabling_axis_]) return;
  enabling_->on_time(time_ns);
  drives_[enabling_axis_]->set_digital_inputs(enabling_->digital_inputs());
}

void SimulatedCell::add_modbus_drive(std::size_t axis) {
  const description::DriveDescription& drive = cell_.drives[axis];
  modbus_drives_[axis] =
      std::make_unique<ModbusDevice>(description::load_modbus_drive(drive.description), drive.node,
                                     drive.max_acceleration_rad_per_s2 * counts_per_rad(drive), *axes_[axis]);
}

std::vector<ModbusUnit*> SimulatedCell::modbus_devices(const std::string& line) {
  std::vector<ModbusUnit*> devices;
  for (std::size_t axis = 0; axis < cell_.drives.size(); ++axis) {
    if (modbus_drives_[axis] && cell_.drives[axis].bus == line) devices.push_back(modbus_drives_[axis].get());
  }
  if (sensor_registers_ && cell_.sensor.bus == line) devices.push_back(sensor_registers_.get());
  return devices;
}

std::unique_ptr<fieldbus::ModbusClient> SimulatedCell::modbus_client(const std::string& line) {
  return std::make_unique<WirelessModbus>(modbus_devices(line));
}

std::unique_ptr<fieldbus::DatagramPort> SimulatedCell::datagram_port() {
  if (!sensor_datagrams_) return std::make_unique<fieldbus::NoDatagrams>();
  return std::make_unique<InProcessPort>(*sensor_datagrams_);
}

void SimulatedCell::add_sensor(const description::SensorDescription& sensor) {
  if (sensor.described) wrench_ = std::make_unique<PlantWrench>(plant_);
  const auto describe = [&](DevicePort& port, std::uint32_t base_id) {
    described_sensor_ =
        std::make_unique<DescribedDevice>(sensor, DescribedDeviceConfig{.base_id = base_id}, *wrench_, port);
  };
  if (sensor.described && sensor.described->registers) {
    sensor_registers_ = std::make_unique<ModbusSensorDevice>(*sensor.described->registers,
                                                             static_cast<std::uint8_t>(cell_.sensor.base_id));
    return describe(*sensor_registers_, 0);
  }
  if (sensor.described && sensor.described->datagrams) {
    sensor_datagrams_ = std::make_unique<DatagramSensorDevice>();
    return describe(*sensor_datagrams_, 0);
  }
  Clockwork& clockwork = *this;
  const std::size_t bus = bus_index(cell_.sensor.bus, "sensor.bus");
  nodes_.push_back(std::make_unique<DeviceNode>("sensor", bus, events_, clockwork));
  if (sensor.described) {
    describe(*nodes_.back(), cell_.sensor.base_id);
    return nodes_.back()->set_device(*described_sensor_);
  }
  AtiDeviceConfig config;
  config.base_id = cell_.sensor.base_id;
  for (std::size_t row = 0; row < 6; ++row) {
    for (std::size_t column = 0; column < 6; ++column) {
      config.matrix[row][column] = static_cast<float>(sensor.simulation.matrix[row][column]);
    }
  }
  config.counts_per_force = sensor.simulation.counts_per_N;
  config.counts_per_torque = sensor.simulation.counts_per_Nm;
  gauges_ = std::make_unique<PlantGauges>(plant_);
  sensor_ = std::make_unique<AtiDevice>(config, *gauges_, *nodes_.back());
  nodes_.back()->set_device(*sensor_);
}

std::size_t SimulatedCell::bus_index(const std::string& name, const std::string& key) const {
  for (std::size_t i = 0; i < cell_.buses.size(); ++i) {
    if (cell_.buses[i].name == name) return i;
  }
  throw SetupError({.file = cell_.file.string(),
                    .key = key,
                    .found = description::in_quotes(name),
                    .expected = "the name of one of the cell's buses"});
}

std::size_t SimulatedCell::axis_of(const std::string& joint) const noexcept {
  std::size_t axis = 0;
  while (axis < cell_.drives.size() && cell_.drives[axis].joint != joint) ++axis;
  return axis;
}

void SimulatedCell::attach_to(fieldbus::SimulatedCanNetwork& network) {
  using fieldbus::NodeFormat;
  const bool fd_sensor = described_sensor_ && !sensor_registers_ && !sensor_datagrams_ && described_sensor_->fd();
  for (const auto& node : nodes_) {
    const auto drive = std::find_if(cell_.drives.begin(), cell_.drives.end(),
                                    [&](const description::DriveDescription& d) { return d.joint == node->name(); });
    const bool fd = drive == cell_.drives.end() ? fd_sensor && node == nodes_.back() : drive->fd;
    const NodeFormat format = fd ? NodeFormat::fd : NodeFormat::classic;
    node->connect(network.simulated_bus(cell_.buses[node->bus()].name).attach(*node, node->name(), format));
  }
}

// ---- Time

void SimulatedCell::power_on() {
  const std::int64_t now_ns = events_.now_ns();
  advance_to(now_ns);
  for (const auto& node : nodes_) node->set_power(true, now_ns);
  const bool any_sync = std::any_of(drives_.begin(), drives_.end(), [](const auto& drive) { return drive != nullptr; });
  if (enabling_ && !any_sync) enabling_->begin_without_sync(now_ns);
  if (sensor_registers_ || sensor_datagrams_) described_sensor_->power_on(now_ns);
  schedule_faults();
  if (described_sensor_ && described_sensor_->period_ns() > 0) {
    events_.schedule(now_ns + described_sensor_->period_ns(), [this](std::int64_t time_ns) { convert(time_ns); });
  }
  events_.schedule(now_ns + tick_ns_, [this](std::int64_t time_ns) { tick(time_ns); });
}

void SimulatedCell::cut_power() noexcept {
  const std::int64_t now_ns = events_.now_ns();
  advance_to(now_ns);
  const DeviceFault lost{.device = "", .kind = DeviceFaultKind::power_loss};
  for (std::size_t axis = 0; axis < drives_.size(); ++axis) {
    if (modbus_drives_[axis]) {
      set_modbus_fault(axis, lost, true);
    } else {
      set_drive_fault(axis, lost, true, now_ns);
    }
  }
}

void SimulatedCell::tick(std::int64_t time_ns) noexcept {
  events_.schedule(time_ns + tick_ns_, [this](std::int64_t next_ns) { tick(next_ns); });
  advance_to(time_ns);
  for (const auto& node : nodes_) node->on_time(time_ns);
  if (sensor_datagrams_) sensor_datagrams_->obey(*described_sensor_, time_ns);
  press(time_ns);
  if (helper_) helper_->on_time(time_ns);
  for (const auto& drive : modbus_drives_) {
    if (drive) drive->on_time(time_ns);
  }
}

// Makes a streaming sensor send its next sample. The sensor's clock doesn't depend on the bus.
void SimulatedCell::convert(std::int64_t time_ns) noexcept {
  advance_to(time_ns);
  described_sensor_->on_converter(time_ns);
  events_.schedule(time_ns + described_sensor_->period_ns(), [this](std::int64_t next_ns) { convert(next_ns); });
}

void SimulatedCell::advance_to(std::int64_t time_ns) noexcept {
  if (!observer_) return plant_.advance_to(time_ns);
  while (plant_.time_ns() + plant_.step_ns() <= time_ns) {
    plant_.advance_to(plant_.time_ns() + plant_.step_ns());
    observer_(present_truth());
  }
}

Truth SimulatedCell::truth() noexcept {
  advance_to(events_.now_ns());
  return present_truth();
}

Truth SimulatedCell::present_truth() const noexcept {
  const ToolState& tool = plant_.tool();
  return {.time_ns = plant_.time_ns(),
          .X_WT = tool.X_WT,
          .velocity_W = tool.velocity_W,
          .acceleration_W = tool.acceleration_W,
          .hand_force_W = plant_.handle_force_W(),
          .hand_torque_W = plant_.handle_torque_W(),
          .sensor_wrench_S = plant_.arm().sensor_wrench_S(),
          .hand_started = plant_.hand_started(),
          .hand_start_ns = plant_.hand_start_ns()};
}

}  // namespace proxarm::sim
