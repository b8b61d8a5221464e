#include "sim/cell/simulated_cell.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "models/base/setup_error.hpp"

namespace proxarm::sim {

namespace {

using description::SetupError;

// 6065h as such drives are delivered: at the joint. The master may set another.
constexpr double following_error_window_rad = 0.05;

double counts_per_rad(const description::DriveDescription& drive) noexcept { return std::abs(drive.counts_per_rad()); }

std::uint32_t to_u32(double value) noexcept {
  return static_cast<std::uint32_t>(std::clamp(std::nearbyint(value), 1.0, 4294967294.0));
}

std::int32_t to_i32(double value) noexcept {
  return static_cast<std::int32_t>(std::clamp(std::nearbyint(value), -2147483648.0, 2147483647.0));
}

DriveDeviceConfig drive_config(const description::DriveDescription& drive, const SimulatedCellConfig& config) {
  DriveDeviceConfig c;
  c.canopen.node = drive.node;
  c.canopen.fd = drive.fd;
  c.canopen.device_type = drive.device_type;
  c.canopen.serial = drive.node;
  c.canopen.revision = 0x00010000;
  c.canopen.device_name = "simulated drive of " + drive.joint;
  c.canopen.boot_time_ns = config.drive_boot_time_ns;
  const double scale = counts_per_rad(drive);
  c.following_error_window_counts = to_u32(following_error_window_rad * scale);
  c.quick_stop_deceleration = to_u32(drive.max_acceleration_rad_per_s2 * scale);
  c.profile_deceleration = to_u32(0.5 * drive.max_acceleration_rad_per_s2 * scale);
  const double first = drive.offset_counts + drive.range_rad[0] * drive.counts_per_rad();
  const double second = drive.offset_counts + drive.range_rad[1] * drive.counts_per_rad();
  c.position_min = to_i32(std::min(first, second));
  c.position_max = to_i32(std::max(first, second));
  c.brake_release_ns = config.brake_release_ns;
  if (drive.rated_torque_Nm > 0.0) c.rated_torque_mNm = to_u32(1e3 * drive.rated_torque_Nm / drive.gear_ratio);
  return c;
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

// ---- Where devices meet the physics

class SimulatedCell::PlantAxis final : public ServoAxis {
 public:
  PlantAxis(Plant& plant, std::size_t axis, const description::DriveDescription& drive)
      : plant_(plant),
        axis_(axis),
        servo_(plant.servo(axis)),
        counts_per_rad_(drive.counts_per_rad()),
        rated_torque_Nm_(drive.rated_torque_Nm > 0.0 ? drive.rated_torque_Nm : drive.simulation.max_torque_Nm),
        max_torque_Nm_(drive.simulation.max_torque_Nm) {}

  void enable(std::int64_t time_ns) noexcept override { plant_.enable(axis_, time_ns); }
  void disable() noexcept override { plant_.switch_off(axis_); }
  void set_interpolation_period_ns(std::int64_t period_ns) noexcept override {
    servo_.set_interpolation_period_ns(period_ns);
  }
  void set_target(std::int32_t target_counts, std::int64_t time_ns) noexcept override {
    servo_.set_target(spoilt(target_counts, time_ns), time_ns);
  }
  void set_torque(double ratio) noexcept override {
    servo_.set_torque_Nm(std::copysign(1.0, counts_per_rad_) * ratio * rated_torque_Nm_);
  }
  void stop(double deceleration_counts_per_s2, std::int64_t time_ns) noexcept override {
    servo_.stop(deceleration_counts_per_s2 / std::abs(counts_per_rad_), time_ns);
  }
  [[nodiscard]] std::int32_t position_counts() const noexcept override {
    return stuck_ ? stuck_at_counts_ : servo_.position_counts() + offset_counts_;
  }
  [[nodiscard]] std::int32_t demand_counts() const noexcept override { return servo_.demand_counts(); }
  [[nodiscard]] double speed_counts_per_s() const noexcept override {
    return servo_.speed_rad_per_s() * counts_per_rad_;
  }
  [[nodiscard]] double torque_ratio() const noexcept override {
    return std::copysign(1.0, counts_per_rad_) * servo_.torque_Nm() / rated_torque_Nm_;
  }
  [[nodiscard]] bool limited() const noexcept override { return servo_.limited(); }
  [[nodiscard]] bool at_rest() const noexcept override { return servo_.at_rest(); }

  // What the drive makes of its targets, what its motor can, and what it says of where it is; false: not one of these.
  bool set_fault(const DeviceFault& fault, bool on, std::int64_t time_ns) noexcept {
    switch (fault.kind) {
      case DeviceFaultKind::runaway:
        runaway_counts_per_s_ = on ? fault.amount * counts_per_rad_ : 0.0;
        break;
      case DeviceFaultKind::reversed:
        target_share_ = on ? -1 : 1;
        break;
      case DeviceFaultKind::ignored:
        target_share_ = on ? 0 : 1;
        break;
      case DeviceFaultKind::weak:
        servo_.set_max_torque_Nm(on ? fault.amount : max_torque_Nm_);
        return true;
      case DeviceFaultKind::offset:
        offset_counts_ = on ? static_cast<std::int32_t>(std::lround(fault.amount * counts_per_rad_)) : 0;
        return true;
      case DeviceFaultKind::stuck:
        stuck_at_counts_ = servo_.position_counts();
        stuck_ = on;
        return true;
      default:
        return false;
    }
    since_ns_ = time_ns;
    since_counts_ = servo_.demand_counts();
    return true;
  }

 private:
  [[nodiscard]] std::int32_t spoilt(std::int32_t target_counts, std::int64_t time_ns) const noexcept {
    if (target_share_ == 1 && runaway_counts_per_s_ == 0.0) return target_counts;
    const double off = runaway_counts_per_s_ * 1e-9 * static_cast<double>(time_ns - since_ns_);
    return since_counts_ + target_share_ * (target_counts - since_counts_) +
           static_cast<std::int32_t>(std::lround(off));
  }

  Plant& plant_;
  std::size_t axis_;
  ServoLoop& servo_;
  double counts_per_rad_, rated_torque_Nm_, max_torque_Nm_;
  double runaway_counts_per_s_ = 0.0;
  std::int32_t target_share_ = 1;  // of the way from since_counts_ to a target
  std::int32_t since_counts_ = 0, offset_counts_ = 0, stuck_at_counts_ = 0;
  std::int64_t since_ns_ = 0;
  bool stuck_ = false;
};

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
      // The master waits in vain for the rest of half an answer.
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

namespace {

// A fault that this sensor can't have would do nothing.
void require_fault_of_sensor(const DeviceFault& fault, const description::SensorDescription& sensor) {
  require_known_fault(fault, FaultyDevice::sensor);
  const bool described = sensor.described.has_value();
  const auto refuse = [&](const char* found, const char* expected) {
    throw SetupError({.file = sensor.file.string(), .key = "device fault", .found = found, .expected = expected});
  };
  if (fault.kind == DeviceFaultKind::bad_checksum && !(described && sensor.described->checksum)) {
    refuse("sensor:checksum for a sensor whose samples have none", "another fault, or a sensor with a checksum");
  }
  if (fault.kind == DeviceFaultKind::status && described && !sensor.described->status) {
    refuse("sensor:status for a sensor whose samples have no status word", "another fault, or a sensor with one");
  }
  if (fault.kind == DeviceFaultKind::status && described &&
      std::uint64_t{fault.value} >> sensor.described->status->number.bits != 0) {
    refuse("sensor:status with bits that the status word hasn't", "one of that word's width");
  }
  constexpr DeviceFaultKind of_registers[] = {DeviceFaultKind::sensor_silent, DeviceFaultKind::frozen,
                                              DeviceFaultKind::saturated, DeviceFaultKind::status};
  const bool has_it = std::find(std::begin(of_registers), std::end(of_registers), fault.kind) != std::end(of_registers);
  if (described && sensor.described->registers && !has_it) {
    refuse("a fault of CAN frames for a sensor on Modbus", "silent, frozen, saturated, or status where it has one");
  }
  const bool of_order = fault.kind == DeviceFaultKind::half_sample || fault.kind == DeviceFaultKind::swapped;
  if (of_order && described && sensor.described->frames.size() < 2) {
    refuse("a fault of the frames' order for a sensor with one frame a sample", "another fault");
  }
}

}  // namespace

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
  check_faults(sensor);
}

SimulatedCell::~SimulatedCell() = default;

void SimulatedCell::add_drive(std::size_t axis, const SimulatedCellConfig& config) {
  const description::DriveDescription& drive = cell_.drives[axis];
  const std::size_t bus = bus_index(drive.bus, "drives[" + std::to_string(axis) + "].bus");
  DriveDeviceConfig device = drive_config(drive, config);
  for (const DeviceFault& fault : faults_) {
    if (fault.device == drive.joint && fault.kind == DeviceFaultKind::device_type) {
      device.canopen.device_type = fault.value;
    }
  }
  Clockwork& clockwork = *this;
  nodes_.push_back(std::make_unique<DeviceNode>(drive.joint, bus, events_, clockwork));
  drives_[axis] = std::make_unique<DriveDevice>(device, *axes_[axis], *nodes_.back());
  nodes_.back()->set_device(*drives_[axis]);
}

// Wired to a drive's inputs, or a node with a message of its own.
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

void SimulatedCell::add_sensor(const description::SensorDescription& sensor) {
  if (sensor.described && sensor.described->registers) {
    wrench_ = std::make_unique<PlantWrench>(plant_);
    sensor_registers_ = std::make_unique<ModbusSensorDevice>(*sensor.described->registers,
                                                             static_cast<std::uint8_t>(cell_.sensor.base_id));
    described_sensor_ =
        std::make_unique<DescribedDevice>(sensor, DescribedDeviceConfig{}, *wrench_, *sensor_registers_);
    return;
  }
  Clockwork& clockwork = *this;
  const std::size_t bus = bus_index(cell_.sensor.bus, "sensor.bus");
  nodes_.push_back(std::make_unique<DeviceNode>("sensor", bus, events_, clockwork));
  if (sensor.described) {
    wrench_ = std::make_unique<PlantWrench>(plant_);
    described_sensor_ = std::make_unique<DescribedDevice>(
        sensor, DescribedDeviceConfig{.base_id = cell_.sensor.base_id}, *wrench_, *nodes_.back());
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
  const bool fd_sensor = described_sensor_ && !sensor_registers_ && described_sensor_->fd();
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
  if (sensor_registers_) described_sensor_->power_on(now_ns);
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
  press(time_ns);
  for (const auto& drive : modbus_drives_) {
    if (drive) drive->on_time(time_ns);
  }
}

// A streaming sensor's own clock: nothing on the bus sets it.
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
          .sensor_wrench_S = plant_.arm().sensor_wrench_S(),
          .hand_started = plant_.hand_started(),
          .hand_start_ns = plant_.hand_start_ns()};
}

// ---- Faults

void SimulatedCell::check_faults(const description::SensorDescription& sensor) const {
  for (const DeviceFault& fault : faults_) {
    const std::size_t axis = axis_of(fault.device);
    if (fault.device == "sensor" || axis < cell_.drives.size()) {
      if (fault.device == "sensor") {
        require_fault_of_sensor(fault, sensor);
      } else {
        require_known_fault(fault, modbus_drives_[axis] ? FaultyDevice::modbus_drive : FaultyDevice::can_drive);
      }
      continue;
    }
    std::string names;
    for (const auto& drive : cell_.drives) names += drive.joint + ", ";
    throw SetupError({.key = "device fault",
                      .found = description::in_quotes(fault.device),
                      .expected = "one of " + names + "sensor"});
  }
}

void SimulatedCell::schedule_faults() {
  const std::int64_t start_ns = events_.now_ns();
  for (std::size_t i = 0; i < faults_.size(); ++i) {
    if (faults_[i].from_ns <= 0) {
      set_fault(i, true, start_ns);
    } else {
      events_.schedule(start_ns + faults_[i].from_ns, [this, i](std::int64_t t) { set_fault(i, true, t); });
    }
    if (faults_[i].until_ns > fieldbus::EventQueue::never - start_ns) continue;
    events_.schedule(start_ns + faults_[i].until_ns, [this, i](std::int64_t t) { set_fault(i, false, t); });
  }
}

void SimulatedCell::set_fault(std::size_t index, bool on, std::int64_t time_ns) noexcept {
  const DeviceFault& fault = faults_[index];
  advance_to(time_ns);
  const std::size_t axis = axis_of(fault.device);
  if (axis < drives_.size() && axes_[axis]->set_fault(fault, on, time_ns)) return;
  if (axis < drives_.size() && modbus_drives_[axis]) {
    set_modbus_fault(axis, fault, on);
  } else if (axis < drives_.size()) {
    set_drive_fault(axis, fault, on, time_ns);
  } else {
    set_sensor_fault(fault, on);
    set_sensor_lie(fault, on, time_ns);
  }
}

void SimulatedCell::set_drive_fault(std::size_t axis, const DeviceFault& fault, bool on,
                                    std::int64_t time_ns) noexcept {
  switch (fault.kind) {
    case DeviceFaultKind::drive_silent:
      return nodes_[node_of_axis_[axis]]->cut(on);
    case DeviceFaultKind::drive_fault:
      if (on) drives_[axis]->inject_fault(static_cast<std::uint16_t>(fault.value), time_ns);
      return;
    case DeviceFaultKind::heartbeat_lost:
      return drives_[axis]->canopen().mute_heartbeat(on);
    case DeviceFaultKind::sdo_silent:
      return drives_[axis]->canopen().mute_sdo(on);
    case DeviceFaultKind::period_fixed:
      return drives_[axis]->fix_period_while_enabled(on);
    case DeviceFaultKind::power_loss:
      if (on) plant_.servo(axis).disable();
      return nodes_[node_of_axis_[axis]]->set_power(!on, time_ns);
    case DeviceFaultKind::jammed:
      return plant_.arm().jam(axis, on);
    default:
      return;
  }
}

void SimulatedCell::set_modbus_fault(std::size_t axis, const DeviceFault& fault, bool on) noexcept {
  ModbusFault kind = ModbusFault::none;
  switch (fault.kind) {
    case DeviceFaultKind::drive_silent:
      kind = ModbusFault::silent;
      break;
    case DeviceFaultKind::power_loss:
      if (on) plant_.servo(axis).disable();
      kind = ModbusFault::silent;
      break;
    case DeviceFaultKind::modbus_exception:
      kind = ModbusFault::exception;
      break;
    case DeviceFaultKind::modbus_closed:
      kind = ModbusFault::closed;
      break;
    case DeviceFaultKind::modbus_wrong_unit:
      kind = ModbusFault::wrong_unit;
      break;
    case DeviceFaultKind::modbus_half:
      kind = ModbusFault::half;
      break;
    case DeviceFaultKind::jammed:
      return plant_.arm().jam(axis, on);
    default:
      return;
  }
  modbus_drives_[axis]->set_fault(on ? kind : ModbusFault::none);
}

SensorFaults& SimulatedCell::sensor_faults() noexcept {
  return described_sensor_ ? described_sensor_->faults() : sensor_->faults();
}

void SimulatedCell::set_sensor_lie(const DeviceFault& fault, bool on, std::int64_t time_ns) noexcept {
  SensorLies& lies = plant_.sensor_lies();
  switch (fault.kind) {
    case DeviceFaultKind::sensor_offset:
      lies.offset_N = on ? fault.amount : 0.0;
      return;
    case DeviceFaultKind::drift:
      lies.drift_N_per_s = on ? fault.amount : 0.0;
      lies.drifts_from_ns = time_ns;
      return;
    case DeviceFaultKind::scale:
      lies.scale = on ? fault.amount : 1.0;
      return;
    case DeviceFaultKind::inverted:
      lies.inverted = on;
      return;
    case DeviceFaultKind::turned:
      lies.turned = on;
      return;
    default:
      return;
  }
}

void SimulatedCell::set_sensor_fault(const DeviceFault& fault, bool on) noexcept {
  SensorFaults& faults = sensor_faults();
  switch (fault.kind) {
    case DeviceFaultKind::sensor_silent:
      faults.silent = on;
      if (sensor_registers_) sensor_registers_->set_silent(on);
      return;
    case DeviceFaultKind::samples_missing:
      faults.silent_samples = on;
      return;
    case DeviceFaultKind::frozen:
      faults.frozen = on;
      return;
    case DeviceFaultKind::half_sample:
      faults.half_sample = on;
      return;
    case DeviceFaultKind::swapped:
      faults.swapped = on;
      return;
    case DeviceFaultKind::duplicated:
      faults.duplicated = on;
      return;
    case DeviceFaultKind::short_frames:
      faults.short_frames = on;
      return;
    case DeviceFaultKind::status:
      faults.status_bits = on ? fault.value : 0;
      return;
    case DeviceFaultKind::bad_checksum:
      faults.bad_checksum = on;
      return;
    case DeviceFaultKind::saturated:
      faults.saturated = on;
      return;
    case DeviceFaultKind::channel_stuck:
      faults.stuck_channel = on ? static_cast<int>(fault.value) : -1;
      return;
    case DeviceFaultKind::lost:
      faults.lost_one_in = on ? fault.value : 0;
      return;
    case DeviceFaultKind::delay:
      faults.delay_ns = on ? std::int64_t{fault.value} * 1'000 : 0;
      return;
    default:
      return;
  }
}

}  // namespace proxarm::sim
