// The part of SimulatedCell that applies and schedules the faults of the simulated devices.
#include <algorithm>
#include <iterator>
#include <utility>

#include "models/base/setup_error.hpp"
#include "sim/cell/plant_axis.hpp"
#include "sim/cell/simulated_cell.hpp"

namespace proxarm::sim {

using description::SetupError;

namespace {

// Throws SetupError for a fault that would have no effect on this sensor.
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

// Throws SetupError for "runaway" in torque mode: a torque setpoint has no position from which the drive could run
// away.
void require_fault_of_mode(const DeviceFault& fault, const description::DriveDescription& drive) {
  if (fault.kind != DeviceFaultKind::runaway || drive.mode != "cst") return;
  throw SetupError({.key = "--fault",
                    .found = "runaway for " + drive.joint + ", whose drive takes torques (mode cst)",
                    .expected = "a fault of what it does with a torque: reversed (the other sign) or ignored (the last "
                                "one acts on)"});
}

constexpr std::pair<DeviceFaultKind, ModbusFault> modbus_faults[] = {
    {DeviceFaultKind::drive_silent, ModbusFault::silent},
    {DeviceFaultKind::power_loss, ModbusFault::silent},
    {DeviceFaultKind::modbus_exception, ModbusFault::exception},
    {DeviceFaultKind::modbus_lost, ModbusFault::lost},
    {DeviceFaultKind::modbus_closed, ModbusFault::closed},
    {DeviceFaultKind::modbus_wrong_unit, ModbusFault::wrong_unit},
    {DeviceFaultKind::modbus_wrong_function, ModbusFault::wrong_function},
    {DeviceFaultKind::modbus_wrong_count, ModbusFault::wrong_count},
    {DeviceFaultKind::modbus_half, ModbusFault::half},
    {DeviceFaultKind::modbus_low_first, ModbusFault::low_word_first},
    {DeviceFaultKind::modbus_forgets, ModbusFault::forgets},
    {DeviceFaultKind::modbus_no_function_23, ModbusFault::no_function_23},
    {DeviceFaultKind::modbus_not_ready, ModbusFault::not_ready},
    {DeviceFaultKind::modbus_not_driven, ModbusFault::not_driven},
    {DeviceFaultKind::modbus_tripped, ModbusFault::tripped}};

// Sets how a drive deviates on the wire.
void set_quirk(SlaveQuirks& quirks, const DeviceFault& fault, bool on) noexcept {
  switch (fault.kind) {
    case DeviceFaultKind::heartbeat_lost:
      quirks.mutes_heartbeat = on;
      return;
    case DeviceFaultKind::sdo_silent:
      quirks.mutes_sdo = on;
      return;
    case DeviceFaultKind::twin:
      quirks.has_twin = on;
      return;
    case DeviceFaultKind::sdo_late:
      quirks.sdo_late_ns = on ? std::int64_t{fault.value} * 1'000'000 : 0;
      return;
    case DeviceFaultKind::sdo_stray:
      quirks.sdo_stray = on;
      return;
    case DeviceFaultKind::sdo_sizeless:
      quirks.sdo_sizeless = on;
      return;
    case DeviceFaultKind::sdo_doubled:
      quirks.sdo_doubled = on;
      return;
    case DeviceFaultKind::guarding:
      quirks.toggles_heartbeat = on;
      return;
    case DeviceFaultKind::sync_lost:
      quirks.hears_no_sync_in = on ? fault.value : 0;
      return;
    case DeviceFaultKind::tpdo_bytes:
      quirks.tpdo_bytes = on ? static_cast<int>(fault.value) : -1;
      return;
    default:
      return;
  }
}

}  // namespace

void SimulatedCell::check_faults(const description::SensorDescription& sensor) const {
  for (const DeviceFault& fault : faults_) {
    const std::size_t axis = axis_of(fault.device);
    if (fault.device == "sensor" || axis < cell_.drives.size()) {
      if (fault.device == "sensor") {
        require_fault_of_sensor(fault, sensor);
      } else {
        require_known_fault(fault, modbus_drives_[axis] ? FaultyDevice::modbus_drive : FaultyDevice::can_drive);
        require_fault_of_mode(fault, cell_.drives[axis]);
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
    case DeviceFaultKind::period_fixed:
      return drives_[axis]->fix_period_while_enabled(on);
    case DeviceFaultKind::sto_open:
      return drives_[axis]->open_sto(on);
    case DeviceFaultKind::bit_12_missing:
      return drives_[axis]->never_say_following(on);
    case DeviceFaultKind::mode_changed:
      return drives_[axis]->show_mode(on ? std::optional(static_cast<std::int8_t>(fault.value)) : std::nullopt);
    case DeviceFaultKind::power_loss:
      if (on) plant_.servo(axis).disable();
      return nodes_[node_of_axis_[axis]]->set_power(!on, time_ns);
    case DeviceFaultKind::jammed:
      return plant_.arm().jam(axis, on);
    case DeviceFaultKind::boot_up:
      if (on) drives_[axis]->canopen().say_boot_up(time_ns);
      return;
    case DeviceFaultKind::warning:
      if (on) drives_[axis]->canopen().say_warning(static_cast<std::uint16_t>(fault.value), time_ns);
      return;
    default:
      return set_quirk(drives_[axis]->canopen().quirks(), fault, on);
  }
}

void SimulatedCell::set_modbus_fault(std::size_t axis, const DeviceFault& fault, bool on) noexcept {
  if (fault.kind == DeviceFaultKind::jammed) return plant_.arm().jam(axis, on);
  if (fault.kind == DeviceFaultKind::power_loss && on) plant_.servo(axis).disable();
  const auto* known = std::find_if(std::begin(modbus_faults), std::end(modbus_faults),
                                   [&](const auto& pair) { return pair.first == fault.kind; });
  if (known == std::end(modbus_faults)) return;
  modbus_drives_[axis]->set_fault(on ? known->second : ModbusFault::none, fault.value);
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
