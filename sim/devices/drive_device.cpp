#include "sim/devices/drive_device.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "sim/devices/eds_objects.hpp"

namespace proxarm::sim {

namespace {

constexpr std::int64_t interpolated_position = 7, cyclic_synchronous_position = 8, cyclic_synchronous_torque = 10;
constexpr std::int64_t modes[] = {interpolated_position, cyclic_synchronous_position, cyclic_synchronous_torque};
constexpr std::int64_t homing_mode = 6;
constexpr std::uint16_t homing_start = 1U << 4;          // bit of the controlword in mode 6
constexpr std::uint16_t interpolation_active = 1U << 4;  // bit of the controlword in mode 7

bool is_cyclic(std::int64_t mode) noexcept {
  return std::find(std::begin(modes), std::end(modes), mode) != std::end(modes);
}

bool is_moving_state(DriveState state) noexcept {
  return state == DriveState::operation_enabled || state == DriveState::quick_stop_active ||
         state == DriveState::fault_reaction_active;
}

}  // namespace

DriveDevice::DriveDevice(const DriveDeviceConfig& config, ServoAxis& axis, DevicePort& port)
    : slave_(config.canopen, *this, port),
      axis_(axis),
      brake_release_ns_(config.brake_release_ns),
      sdo_request_id_(0x600u + config.canopen.node),
      incremental_(config.incremental) {
  add_objects(config);
  add_option_codes();
  add_cyclic_objects(config);
  if (incremental_) add_homing_objects();
  slave_.receive_pdo(1).set_default_mapping({config.objects.controlword << 8 | 0x10});
  slave_.transmit_pdo(1).set_default_mapping({config.objects.statusword << 8 | 0x10});
  if (config.eds != nullptr) take_over(*config.eds, config.canopen.node, slave_.dictionary());
}

void DriveDevice::power_on(std::int64_t time_ns) noexcept {
  now_ns_ = time_ns;
  slave_.power_on(time_ns);
}

void DriveDevice::on_frame(const fieldbus::CanFrame& frame, std::int64_t time_ns) noexcept {
  now_ns_ = time_ns;
  if (frame.id == sdo_request_id_) publish();
  slave_.on_frame(frame, time_ns);
}

void DriveDevice::on_time(std::int64_t time_ns) noexcept {
  now_ns_ = time_ns;
  show_mode();
  supervise_sync();
  supervise_following_error();
  if (stopping_ && axis_.at_rest()) finish_stop();
  advance_homing();
  publish();
  slave_.on_time(time_ns);
}

// ---- Objects

void DriveDevice::add_objects(const DriveDeviceConfig& config) {
  using enum DataType;
  using enum Access;
  ObjectDictionary& od = slave_.dictionary();
  error_code_ = &od.add(0x603F, 0, unsigned16, read_only, 0, true);
  const description::DriveObjects& at = config.objects;
  controlword_ = &add(at.controlword, unsigned16, read_write, 0, true);
  controlword_->after_write = [this] { on_controlword(); };
  statusword_ = &add(at.statusword, unsigned16, read_only, 0, true);
  mode_ = &add(at.mode, integer8, read_write, 0, true);
  mode_->before_write = [incremental = incremental_.has_value()](std::int64_t mode) {
    const bool can_home = incremental && mode == homing_mode;
    return mode == 0 || can_home || is_cyclic(mode) ? SdoAbort::none : SdoAbort::invalid_value;
  };
  mode_display_ = &add(at.mode_display, integer8, read_only, 0, true);
  demand_ = &od.add(0x6062, 0, integer32, read_only, 0, true);
  position_ = &add(at.position, integer32, read_only, 0, true);
  od.add(0x6065, 0, unsigned32, read_write, config.following_error_window_counts);
  od.add(0x6066, 0, unsigned16, read_write, config.following_error_time_ms);
  velocity_ = &od.add(0x606C, 0, integer32, read_only, 0, true);
  target_torque_ = &add(config.torque_target, integer16, read_write, 0, true);
  target_torque_->after_write = [this] { target_fresh_ = mode_->number() == cyclic_synchronous_torque; };
  max_torque_ = &od.add(0x6072, 0, unsigned16, read_write, 3000);
  od.add(0x6076, 0, unsigned32, constant, config.rated_torque_mNm);
  torque_ = &add(at.torque, integer16, read_only, 0, true);
  if (config.gear_torque) {
    const DataType type = config.gear_torque->bits == 16 ? integer16 : integer32;
    gear_torque_ = &add(config.gear_torque->object, type, read_only, 0, true);
  }
  following_error_ = &od.add(0x60F4, 0, integer32, read_only, 0, true);
  digital_inputs_ = &od.add(0x60FD, 0, unsigned32, read_only, 0, true);
  std::int64_t supported = 0;
  for (const std::int64_t mode : modes) supported |= std::int64_t{1} << (mode - 1);
  if (incremental_) supported |= std::int64_t{1} << (homing_mode - 1);
  add(at.supported_modes, unsigned32, constant, supported);
  add_own_objects(config);
}

// Adds 2001h and 2010h:01, which only a drive with the default dictionary shows: a maker's dictionary has other objects
// there.
void DriveDevice::add_own_objects(const DriveDeviceConfig& config) {
  using enum DataType;
  using enum Access;
  if (config.eds != nullptr) {
    for (ObjectEntry& entry : unlisted_) {
      entry.type = unsigned8;
      entry.value.assign(1, 0);
    }
    refusal_ = &unlisted_[0];
    sync_tolerance_ = &unlisted_[1];
    return sync_tolerance_->set(config.sync_tolerance_periods);
  }
  ObjectDictionary& od = slave_.dictionary();
  refusal_ = &od.add(0x2001, 0, unsigned8, read_only, 0, true);
  od.add(0x2010, 0, unsigned8, constant, 1);
  sync_tolerance_ = &od.add(0x2010, 1, unsigned8, read_write, config.sync_tolerance_periods);
}

ObjectEntry& DriveDevice::add(std::uint32_t address, DataType type, Access access, std::int64_t value, bool mappable) {
  return slave_.dictionary().add(static_cast<std::uint16_t>(address >> 8), static_cast<std::uint8_t>(address), type,
                                 access, value, mappable);
}

// Adds the option codes, which select the drive's reactions. Codes of ramps that this drive doesn't have are refused.
void DriveDevice::add_option_codes() {
  using enum DataType;
  ObjectDictionary& od = slave_.dictionary();
  const auto option = [&od](std::uint16_t index, std::int64_t value, std::uint32_t allowed) {
    od.add(index, 0, integer16, Access::read_write, value).before_write = [allowed](std::int64_t code) {
      return code >= 0 && code < 32 && (allowed >> code & 1) != 0 ? SdoAbort::none : SdoAbort::invalid_value;
    };
  };
  option(0x6007, 1, 0b1111);  // connection lost: 0 nothing, 1 fault, 2 disable voltage, 3 quick stop
  // Quick stop: 0 off, 1 ramp 6084h, 2 ramp 6085h; 5 and 6 use the ramps of 1 and 2 and stay in quick stop active.
  option(0x605A, 2, 0b1100111);
  option(0x605B, 0, 0b11);   // shutdown: 0 off, 1 ramp 6084h
  option(0x605C, 1, 0b11);   // disable operation: 0 off, 1 ramp 6084h
  option(0x605D, 1, 0b110);  // halt: 1 ramp 6084h, 2 ramp 6085h (no effect in cyclic modes)
  option(0x605E, 2, 0b111);  // fault: 0 off, 1 ramp 6084h, 2 ramp 6085h
}

void DriveDevice::add_cyclic_objects(const DriveDeviceConfig& config) {
  using enum DataType;
  using enum Access;
  ObjectDictionary& od = slave_.dictionary();
  target_ = &add(config.position_target, integer32, read_write, 0, true);
  target_->after_write = [this] { target_fresh_ = mode_->number() == cyclic_synchronous_position; };
  od.add(0x607D, 0, unsigned8, constant, 2);
  od.add(0x607D, 1, integer32, read_write, config.position_min);
  od.add(0x607D, 2, integer32, read_write, config.position_max);
  od.add(0x6084, 0, unsigned32, read_write, config.profile_deceleration).minimum = 1;
  od.add(0x6085, 0, unsigned32, read_write, config.quick_stop_deceleration).minimum = 1;
  od.add(0x60C1, 0, unsigned8, constant, 1);
  interpolated_target_ = &add(config.interpolated_target, integer32, read_write, 0, true);
  interpolated_target_->after_write = [this] { target_fresh_ = mode_->number() == interpolated_position; };
  od.add(0x60C2, 0, unsigned8, constant, 2);
  const auto not_while_enabled = [this](std::int64_t) {
    return period_fixed_ && state_ == DriveState::operation_enabled ? SdoAbort::not_in_present_device_state
                                                                    : SdoAbort::none;
  };
  period_value_ = &add(config.objects.interpolation_value, unsigned8, read_write, 0);
  period_index_ = &add(config.objects.interpolation_index, integer8, read_write, -3);
  for (ObjectEntry* entry : {period_value_, period_index_}) {
    entry->before_write = not_while_enabled;
    entry->after_write = [this] { set_period(); };
  }
  following_window_ = &od.at(0x6065);
}

// ---- Homing

void DriveDevice::add_homing_objects() {
  using enum DataType;
  using enum Access;
  ObjectDictionary& od = slave_.dictionary();
  od.add(0x607C, 0, integer32, read_write, 0);
  od.add(0x6098, 0, integer8, read_write, 0);
  od.add(0x6099, 0, unsigned8, constant, 2);
  od.add(0x6099, 1, unsigned32, read_write, 0);
  od.add(0x6099, 2, unsigned32, read_write, 0);
  od.add(0x609A, 0, unsigned32, read_write, 0);
}

// Sets the encoder's zero at power on. An incremental encoder that wasn't homed has its zero at the current position,
// because CiA 402 keeps no position from before power on.
void DriveDevice::power_on_encoder() noexcept {
  homing_ = HomingState::none;
  if (!incremental_) return;
  zero_counts_ = incremental_->homed ? incremental_->home_counts : axis_.position_counts();
}

bool DriveDevice::homes() const noexcept { return mode_->number() == homing_mode && incremental_.has_value(); }

// Starts homing. Methods 1 to 34 look for a switch, a stop or an index pulse; here they all find the same place.
void DriveDevice::start_homing() {
  const std::int64_t method = slave_.dictionary().number(0x6098);
  const bool known = method >= 1 && method <= 34 && slave_.dictionary().number(0x6099, 1) > 0;
  homing_ = known ? HomingState::running : HomingState::failed;
  homing_counts_ = axis_.position_counts();
  homing_ns_ = now_ns_;
}

void DriveDevice::advance_homing() {
  if (homing_ != HomingState::running) return;
  if (state_ != DriveState::operation_enabled || stopping_) {
    homing_ = HomingState::failed;
    return;
  }
  const double elapsed_s = 1e-9 * static_cast<double>(now_ns_ - homing_ns_);
  homing_ns_ = now_ns_;
  if (!brake_open() || elapsed_s <= 0.0) return;
  const double home = incremental_->home_counts;
  const double step = elapsed_s * static_cast<double>(slave_.dictionary().number(0x6099, 1));
  homing_counts_ += std::clamp(home - homing_counts_, -step, step);
  axis_.set_interpolation_period_ns(std::llround(1e9 * elapsed_s));
  axis_.set_target(static_cast<std::int32_t>(homing_counts_), now_ns_);
  const double settled_counts = std::max(1.0, 0.02 * static_cast<double>(following_window_->number()));
  if (homing_counts_ != home || std::abs(axis_.position_counts() - home) > settled_counts) return;
  // 607Ch is the offset from the home position to the zero
  zero_counts_ = incremental_->home_counts + slave_.dictionary().number(0x607C);
  homing_ = HomingState::attained;
}

// ---- SYNC

void DriveDevice::on_sync(std::int64_t time_ns) {
  if (last_sync_ns_ != never) {
    intervals_ns_[interval_next_] = time_ns - last_sync_ns_;
    interval_next_ = (interval_next_ + 1) % intervals;
    interval_count_ = std::min(interval_count_ + 1, intervals);
  }
  last_sync_ns_ = time_ns;
  latch_target();
  publish();
}

// Applies the target torque. If no new torque came, the last torque acts until the receive PDO's timer or the SYNC
// watch ends it.
void DriveDevice::latch_torque() {
  following_ = false;
  if (state_ != DriveState::operation_enabled || stopping_ || !brake_open()) return;
  const std::int64_t most = max_torque_->number(), wanted = target_torque_->number();
  const std::int64_t torque = std::clamp(wanted, -most, most);
  target_limited_ = torque != wanted;
  axis_.set_torque(1e-3 * static_cast<double>(torque));
  following_ = true;
}

// Applies the target position. Position limits (607Dh) clamp the target. If no PDO came since the last SYNC, 607Ah is
// old, and the axis decelerates instead.
void DriveDevice::latch_target() {
  if (mode_->number() == cyclic_synchronous_torque) return latch_torque();
  if (homes()) return;
  const bool interpolates = mode_->number() == interpolated_position;
  const bool valid = !interpolates || (controlword_->number() & interpolation_active) != 0;
  const bool fresh = target_fresh_ && valid;
  target_fresh_ = false;
  following_ = false;
  if (state_ != DriveState::operation_enabled || stopping_ || !brake_open()) return;
  if (!fresh) return axis_.stop(deceleration(0x6085), now_ns_);
  const ObjectDictionary& od = slave_.dictionary();
  const std::int64_t low = od.number(0x607D, 1), high = od.number(0x607D, 2);
  std::int64_t target = (interpolates ? interpolated_target_ : target_)->number();
  target_limited_ = low < high && (target < low || target > high);
  if (target_limited_) target = std::clamp(target, low, high);
  // The first target after the brake has opened must be within the following error window of the actual position, so
  // that the axis doesn't jump.
  if (!target_taken_ && std::llabs(target - position()) > following_window_->number()) {
    return trip(emcy::following_error, error_register::profile_specific);
  }
  target_taken_ = true;
  axis_.set_interpolation_period_ns(period_ns_);
  axis_.set_target(static_cast<std::int32_t>(target + zero_counts_), now_ns_);
  following_ = !target_limited_;
}

// Updates the objects that PDOs and SDOs read.
void DriveDevice::publish() noexcept {
  position_->set(position());
  demand_->set(demand());
  following_error_->set(powered_ ? demand() - position() : 0);
  const double speed = axis_.speed_counts_per_s();
  velocity_->set(
      static_cast<std::int64_t>(std::isfinite(speed) ? std::clamp(speed, -2147483648.0, 2147483647.0) : 0.0));
  torque_->set(static_cast<std::int64_t>(std::lround(1000.0 * std::clamp(axis_.torque_ratio(), -32.767, 32.767))));
  if (gear_torque_ != nullptr) gear_torque_->set(axis_.gear_torque_counts());
  statusword_->set(statusword());
}

// Returns the statusword. Besides the state it has these bits: 4 voltage enabled, 7 warning, 9 remote, 11 internal
// limit, 12 the drive follows the target, 13 following error.
std::uint16_t DriveDevice::statusword() const noexcept {
  unsigned word = statusword_bits(state_) | 0x0010u;
  const NmtState nmt = slave_.state();
  if (nmt == NmtState::operational) word |= 0x0200u;
  if (refusal_->number() != 0) word |= 0x0080u;
  if (powered_ && (target_limited_ || axis_.limited())) word |= 0x0800u;
  if (homes()) {
    if (homing_ != HomingState::running) word |= 0x0400u;
    if (homing_ == HomingState::attained) word |= 0x1000u;
    if (homing_ == HomingState::failed) word |= 0x2000u;
    return static_cast<std::uint16_t>(word);
  }
  const bool has_its_bits = (controlword_->number() & wanted_bits_) == wanted_bits_;
  const bool says_following = following_ && has_its_bits && !never_following_;
  if (says_following && state_ == DriveState::operation_enabled) word |= 0x1000u;
  if (following_error_since_ns_ != never) word |= 0x2000u;
  return static_cast<std::uint16_t>(word);
}

// ---- State machine

void DriveDevice::show_mode() noexcept {
  const bool hidden = shows_mode_late_ && state_ != DriveState::operation_enabled;
  mode_display_->set(shown_mode_ ? *shown_mode_ : hidden ? 0 : mode_->number());
}

void DriveDevice::open_sto(bool open) noexcept {
  sto_open_ = open;
  const bool above = state_ != DriveState::not_ready_to_switch_on && state_ != DriveState::fault;
  if (open && above && state_ != DriveState::switch_on_disabled) enter(DriveState::switch_on_disabled, 9);
}

void DriveDevice::on_controlword() {
  const auto word = static_cast<std::uint16_t>(controlword_->number());
  const bool starts_homing = homes() && (word & homing_start) != 0 && (controlword_before_ & homing_start) == 0;
  const DriveCommand command = decode_controlword(word, controlword_before_);
  controlword_before_ = word;
  if (command == DriveCommand::disable_voltage && is_moving_state(state_) && stopping_) {
    stopping_ = false;  // disable voltage switches the power off even during a ramp
    if (state_ == DriveState::fault_reaction_active) return enter(DriveState::fault, 14);
  }
  if (stopping_) return;
  if (sto_open_ && command != DriveCommand::fault_reset) return;
  for (int step = 0; step < 2; ++step) {  // transitions 3 and 4 are taken together if operation is commanded at once
    const DriveTransition transition = transition_for(state_, command);
    if (transition.number == 0) break;
    execute(transition);
    if (transition.number != 3 || command != DriveCommand::enable_operation) break;
  }
  if (command != DriveCommand::enable_operation) refusal_->set(0);
  if (starts_homing && state_ == DriveState::operation_enabled) start_homing();
}

void DriveDevice::execute(DriveTransition transition) {
  const ObjectDictionary& od = slave_.dictionary();
  switch (transition.number) {
    case 4: {
      const RefusalReason reason = refusal();
      refusal_->set(static_cast<std::int64_t>(reason));
      if (reason == RefusalReason::none) enter(transition.to, 4);
      return;
    }
    case 5:
      if (od.number(0x605C) == 1) return begin_stop(transition.to, 5, deceleration(0x6084));
      return enter(transition.to, 5);
    case 8:
      if (od.number(0x605B) == 1) return begin_stop(transition.to, 8, deceleration(0x6084));
      return enter(transition.to, 8);
    case 11: {
      const std::int64_t option = od.number(0x605A);
      if (option == 0) return enter(DriveState::switch_on_disabled, 12);
      const double ramp = deceleration(option == 1 || option == 5 ? 0x6084 : 0x6085);
      enter(DriveState::quick_stop_active, 11);
      if (option >= 5) return axis_.stop(ramp, now_ns_);  // the drive stays in quick stop active
      return begin_stop(DriveState::switch_on_disabled, 12, ramp);
    }
    case 15:
      slave_.acknowledge(now_ns_);
      if (slave_.has_error(emcy::heartbeat_lost) || slave_.has_error(emcy::rpdo_timeout)) {
        // The cause of the error persists: the connection must return first and restart the timers.
        return;
      }
      slave_.clear_error(fault_code_, now_ns_);
      fault_code_ = 0;
      error_code_->set(0);
      return enter(transition.to, 15);
    case 16:
      if (od.number(0x605A) < 5) return;
      return enter(transition.to, 16);
    default:
      return enter(transition.to, transition.number);
  }
}

void DriveDevice::enter(DriveState to, int transition) {
  state_ = to;
  last_transition_ = transition;
  following_error_since_ns_ = never;
  stopping_ = false;
  if (is_moving_state(to)) {
    if (!powered_) {
      axis_.enable(now_ns_);
      powered_ = true;
      brake_open_ns_ = now_ns_ + brake_release_ns_;
      target_taken_ = false;
    }
  } else {
    power_off();
  }
}

void DriveDevice::power_off() noexcept {
  following_ = target_limited_ = false;
  if (!powered_) return;
  powered_ = false;
  axis_.disable();
}

// Begins a ramp. The drive keeps its state until the axis is at rest, then enters the state `after`.
void DriveDevice::begin_stop(DriveState after, int transition, double deceleration_counts_per_s2) {
  stopping_ = true;
  after_stop_ = after;
  after_stop_transition_ = transition;
  following_ = false;
  axis_.stop(deceleration_counts_per_s2, now_ns_);
}

void DriveDevice::finish_stop() { enter(after_stop_, after_stop_transition_); }

RefusalReason DriveDevice::refusal() const noexcept {
  if (slave_.state() != NmtState::operational) return RefusalReason::not_operational;
  const std::int64_t mode = (shows_mode_late_ ? mode_ : mode_display_)->number();
  if (mode == homing_mode && incremental_) return RefusalReason::none;
  if (!is_cyclic(mode)) return RefusalReason::mode_not_displayed;
  if (period_ns_ <= 0) return RefusalReason::interpolation_period_not_set;
  if (interval_count_ < 3) return RefusalReason::no_sync;
  std::int64_t sum = 0;
  for (int i = 0; i < interval_count_; ++i) sum += intervals_ns_[i];
  const double ratio = static_cast<double>(sum) / interval_count_ / static_cast<double>(period_ns_);
  if (!(ratio > 0.8 && ratio < 1.2)) return RefusalReason::sync_period_mismatch;
  if (mode == cyclic_synchronous_torque) return RefusalReason::none;
  const std::int64_t target = (mode == interpolated_position ? interpolated_target_ : target_)->number();
  const std::int64_t distance = std::llabs(target - position());
  if (distance > following_window_->number()) return RefusalReason::target_far_from_actual;
  return RefusalReason::none;
}

bool DriveDevice::energised() const noexcept { return powered_; }

// Computes the period from 60C2h: value (u8) · 10^exponent (i8) s. The period is 0 if 60C2h isn't set or is longer than
// 1 s.
void DriveDevice::set_period() {
  const double period_s =
      static_cast<double>(period_value_->number()) * std::pow(10.0, static_cast<double>(period_index_->number()));
  period_ns_ = period_s > 0.0 && period_s <= 1.0 ? std::llround(period_s * 1e9) : 0;
}

double DriveDevice::deceleration(std::uint16_t object) const noexcept {
  return static_cast<double>(std::max<std::int64_t>(slave_.dictionary().number(object), 1));
}

// ---- Supervision

void DriveDevice::trip(std::uint16_t code, std::uint8_t register_bits) {
  if (state_ == DriveState::fault || state_ == DriveState::fault_reaction_active) return;
  fault_code_ = code;
  error_code_->set(code);
  slave_.raise_error(code, register_bits, now_ns_);
  if (!powered_) return enter(DriveState::fault, 14);
  const std::int64_t option = slave_.dictionary().number(0x605E);
  if (option == 0) return enter(DriveState::fault, 14);
  enter(DriveState::fault_reaction_active, 13);
  begin_stop(DriveState::fault, 14, deceleration(option == 1 ? 0x6084 : 0x6085));
}

void DriveDevice::inject_fault(std::uint16_t code, std::int64_t time_ns) noexcept {
  now_ns_ = time_ns;
  trip(code, error_register::profile_specific);
}

void DriveDevice::supervise_sync() {
  const std::int64_t tolerance = sync_tolerance_->number();
  const bool lazy = is_lazy(slave_.config().stack);
  if (state_ != DriveState::operation_enabled || lazy || homes() || tolerance == 0 || last_sync_ns_ == never) return;
  if (now_ns_ - last_sync_ns_ > tolerance * period_ns_) trip(emcy::sync_controller, error_register::communication);
}

// Trips with 8611h if the following error exceeds the window (6065h) for longer than the time in 6066h.
void DriveDevice::supervise_following_error() {
  if (!energised() || !brake_open()) return;
  const ObjectDictionary& od = slave_.dictionary();
  const std::int64_t window = following_window_->number();
  const std::int64_t error = std::llabs(std::int64_t{axis_.demand_counts()} - axis_.position_counts());
  if (window == 0xFFFFFFFF || error <= window) {
    following_error_since_ns_ = never;
    return;
  }
  if (following_error_since_ns_ == never) following_error_since_ns_ = now_ns_;
  if (now_ns_ - following_error_since_ns_ >= od.number(0x6066) * 1'000'000) {
    trip(emcy::following_error, error_register::profile_specific);
  }
}

void DriveDevice::on_communication_lost(std::uint16_t code, std::int64_t time_ns) {
  now_ns_ = time_ns;
  react_to_connection(slave_.dictionary().number(0x6007), code);
}

// Reacts to a lost connection as 6007h says: 0 nothing, 1 fault, 2 disable voltage, 3 quick stop.
void DriveDevice::react_to_connection(std::int64_t option, std::uint16_t code) {
  if (latches() && code != emcy::communication) return trip(code, error_register::communication);
  if (state_ != DriveState::operation_enabled || stopping_) return;
  if (option == 1) return trip(code, error_register::communication);
  if (option == 2) return enter(DriveState::switch_on_disabled, 9);
  if (option == 3) execute({11, DriveState::quick_stop_active});
}

void DriveDevice::on_nmt_state(NmtState from, NmtState to, std::int64_t time_ns) {
  now_ns_ = time_ns;
  if (to == NmtState::initialising && is_moving_state(state_)) return enter(DriveState::switch_on_disabled, 9);
  if (from == NmtState::initialising && state_ == DriveState::not_ready_to_switch_on) {
    enter(DriveState::switch_on_disabled, 1);
  }
  // If the drive leaves NMT operational while it moves, this counts as a lost connection.
  if (from == NmtState::operational) react_to_connection(slave_.dictionary().number(0x6007), emcy::communication);
}

void DriveDevice::on_reset(std::int64_t time_ns) {
  now_ns_ = time_ns;
  power_off();
  power_on_encoder();
  state_ = DriveState::not_ready_to_switch_on;
  last_transition_ = 0;
  controlword_before_ = 0;
  stopping_ = false;
  fault_code_ = 0;
  target_fresh_ = false;
  following_error_since_ns_ = never;
  last_sync_ns_ = never;
  interval_count_ = interval_next_ = 0;
  set_period();
}

}  // namespace proxarm::sim
