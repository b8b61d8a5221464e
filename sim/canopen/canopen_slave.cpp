#include "sim/canopen/canopen_slave.hpp"

#include <algorithm>

#include "fieldbus/can/can_timing.hpp"

namespace proxarm::sim {

namespace {

constexpr std::int64_t millisecond = 1'000'000;
// After this time without a request, a transfer counts as abandoned by the client and is ended.
constexpr std::int64_t sdo_timeout = 1'000 * millisecond;

fieldbus::CanFrame make_frame(std::uint32_t id, std::span<const std::uint8_t> bytes) noexcept {
  fieldbus::CanFrame frame;
  frame.id = id;
  frame.length = static_cast<std::uint8_t>(bytes.size());
  std::copy(bytes.begin(), bytes.end(), frame.data.begin());
  return frame;
}

}  // namespace

CanopenSlave::CanopenSlave(const CanopenSlaveConfig& config, CanopenApplication& application, DevicePort& port)
    : config_(config), application_(application), port_(port) {
  errors_.reserve(16);
  add_communication_objects();
  for (int number = 1; number <= pdos; ++number) {
    receive_.push_back(std::make_unique<Receive>(dictionary_, number, config.node, config.fd));
    transmit_.push_back(std::make_unique<Transmit>(dictionary_, number, config.node, config.fd));
  }
}

void CanopenSlave::add_communication_objects() {
  using enum DataType;
  using enum Access;
  ObjectDictionary& od = dictionary_;
  od.add(0x1000, 0, unsigned32, constant, config_.device_type);
  od.add(0x1001, 0, unsigned8, read_only, 0, true);
  od.add(0x1003, 0, unsigned8, read_write, 0).maximum = 0;  // only 0 may be written; it clears the error history
  for (std::uint8_t i = 1; i <= 8; ++i) od.add(0x1003, i, unsigned32, read_only, 0);
  sync_id_ = &od.add(0x1005, 0, unsigned32, read_write, 0x80);
  sync_id_->before_write = [](std::int64_t value) {
    // Bit 30 must be 0: the device doesn't generate SYNC.
    return (value & ~0x7FF) == 0 ? SdoAbort::none : SdoAbort::invalid_value;
  };
  od.add(0x1006, 0, unsigned32, read_write, 0);
  sync_window_ = &od.add(0x1007, 0, unsigned32, read_write, 0);
  od.add(0x100C, 0, unsigned16, read_write, 0);
  od.add(0x100D, 0, unsigned8, read_write, 0);
  od.add_text(0x1008, 0, config_.device_name);
  od.add_text(0x1009, 0, "simulated");
  od.add_text(0x100A, 0, "1.0");
  od.add(0x1014, 0, unsigned32, read_only, 0x80 + config_.node);
  od.add(0x1016, 0, unsigned8, constant, consumers);
  for (std::uint8_t i = 1; i <= consumers; ++i) {
    ObjectEntry& entry = od.add(0x1016, i, unsigned32, read_write, 0);
    entry.before_write = [this, i](std::int64_t value) { return check_consumer(i, value); };
    entry.after_write = [this] { configure_consumers(); };
  }
  od.add(0x1017, 0, unsigned16, read_write, 0).after_write = [this] {
    heartbeat_period_ns_ = dictionary_.number(0x1017) * millisecond;
    heartbeat_ns_ = 0;  // sends the first heartbeat at once
  };
  od.add(0x1018, 0, unsigned8, constant, 4);
  od.add(0x1018, 1, unsigned32, constant, config_.vendor);
  od.add(0x1018, 2, unsigned32, constant, config_.product);
  od.add(0x1018, 3, unsigned32, constant, config_.revision);
  od.add(0x1018, 4, unsigned32, constant, config_.serial);
  od.add(0x1019, 0, unsigned8, constant, 0);
  od.add(0x1020, 0, unsigned8, constant, 2);
  od.add(0x1020, 1, unsigned32, read_write, 0);
  od.add(0x1020, 2, unsigned32, read_write, 0);
  od.add(0x1029, 0, unsigned8, constant, 1);
  od.add(0x1029, 1, unsigned8, read_write, 0).maximum = 2;
  od.add(0x1200, 0, unsigned8, constant, 2);
  od.add(0x1200, 1, unsigned32, constant, 0x600 + config_.node);
  od.add(0x1200, 2, unsigned32, constant, 0x580 + config_.node);
}

// ---- NMT

void CanopenSlave::power_on(std::int64_t time_ns) noexcept { start_over(true, time_ns); }

void CanopenSlave::start_over(bool whole_device, std::int64_t time_ns) {
  enter(NmtState::initialising, time_ns);
  dictionary_.restore_defaults(0x1000, whole_device ? 0xFFFF : 0x1FFF);
  for (auto& receive : receive_) {
    receive->pdo.configure();
    receive->waiting = receive->overdue = false;
    receive->last_ns = never;
  }
  for (auto& transmit : transmit_) {
    transmit->pdo.configure();
    transmit->last_ns = never;
    transmit->syncs = 0;
  }
  configure_consumers();
  heartbeat_period_ns_ = 0;
  sdo_.reset();
  errors_.clear();
  last_sync_ns_ = last_guard_ns_ = never;
  life_lost_ = toggle_ = false;
  boot_ns_ = time_ns + config_.boot_time_ns;
  if (whole_device) application_.on_reset(time_ns);
}

void CanopenSlave::enter(NmtState to, std::int64_t time_ns) {
  if (to == state_) return;
  const NmtState from = state_;
  state_ = to;
  if (to != NmtState::operational) {
    for (auto& receive : receive_) {
      receive->waiting = receive->overdue = false;
      receive->last_ns = never;
    }
  } else {
    if (config_.stack == StackBehaviour::lazy) last_sync_ns_ = never;  // SYNC is watched from the first SYNC on
    for (auto& transmit : transmit_) {
      transmit->last_ns = never;
      transmit->syncs = 0;
    }
  }
  application_.on_nmt_state(from, to, time_ns);
}

void CanopenSlave::on_nmt_command(const fieldbus::CanFrame& frame, std::int64_t time_ns) {
  if (frame.length != 2 || (frame.data[1] != 0 && frame.data[1] != config_.node)) return;
  switch (frame.data[0]) {
    case 0x01:
      if (!refuses_start()) enter(NmtState::operational, time_ns);
      return;
    case 0x02:
      return enter(NmtState::stopped, time_ns);
    case 0x80:
      return enter(NmtState::pre_operational, time_ns);
    case 0x81:
      return start_over(true, time_ns);
    case 0x82:
      return start_over(false, time_ns);
    default:
      return;
  }
}

bool CanopenSlave::refuses_start() const noexcept {
  return holds_nmt_start(config_.stack) && (has_error(emcy::communication) || has_error(emcy::heartbeat_lost));
}

void CanopenSlave::send_state(NmtState state, std::int64_t time_ns) noexcept {
  if (quirks_.toggles_heartbeat) toggle_ = !toggle_;
  const bool sets_bit_7 = quirks_.toggles_heartbeat && toggle_ && state != NmtState::initialising;
  const auto byte = static_cast<std::uint8_t>(static_cast<unsigned>(state) | (sets_bit_7 ? 0x80U : 0U));
  if (!quirks_.mutes_heartbeat) port_.send(make_frame(0x700u + config_.node, {&byte, 1}), time_ns);
}

// ---- Frames in

void CanopenSlave::on_frame(const fieldbus::CanFrame& frame, std::int64_t time_ns) noexcept {
  const bool is_guarded = frame.remote && !frame.extended && frame.id == 0x700u + config_.node;
  if (is_guarded && state_ != NmtState::initialising) return on_guard_request(time_ns);
  if (frame.extended || frame.remote || frame.error || frame.length > (frame.fd ? 64 : 8)) return;
  if (frame.fd != (config_.fd && is_pdo(frame.id))) return;  // only PDOs are CAN FD frames
  if (state_ == NmtState::initialising) return;
  if (frame.id == 0) return on_nmt_command(frame, time_ns);
  if (frame.id > 0x700 && frame.id <= 0x77F) {
    return on_heartbeat(static_cast<std::uint8_t>(frame.id - 0x700), frame, time_ns);
  }
  if (talks() && frame.id == 0x600u + config_.node) return on_sdo(frame, time_ns);
  if (talks() && frame.id == static_cast<std::uint32_t>(sync_id_->number() & 0x7FF)) return on_sync(frame, time_ns);
  if (state_ != NmtState::operational) return;
  for (auto& receive : receive_) {
    if (receive->pdo.valid() && receive->pdo.identifier() == frame.id) on_receive_pdo(*receive, frame, time_ns);
  }
}

bool CanopenSlave::is_pdo(std::uint32_t id) const noexcept {
  return std::any_of(receive_.begin(), receive_.end(),
                     [&](const auto& receive) { return receive->pdo.valid() && receive->pdo.identifier() == id; });
}

void CanopenSlave::on_sdo(const fieldbus::CanFrame& frame, std::int64_t time_ns) {
  if (frame.length != 8 || quirks_.mutes_sdo) return;
  SdoServer::Message request;
  std::copy_n(frame.data.begin(), 8, request.begin());
  last_sdo_ns_ = time_ns;
  for (const SdoServer::Message& message : sdo_.on_request(request)) {
    answer_sdo(message, time_ns + config_.sdo_answer_time_ns + quirks_.sdo_late_ns);
  }
}

void CanopenSlave::answer_sdo(SdoServer::Message message, std::int64_t time_ns) noexcept {
  constexpr unsigned kind_mask = 0xE3, expedited_with_size = 0x43, expedited = 0x42;
  if (quirks_.sdo_sizeless && (message[0] & kind_mask) == expedited_with_size) message[0] = expedited;
  const auto id = 0x580u + config_.node;
  if (quirks_.sdo_stray) {
    SdoServer::Message stray = message;
    stray[1] = 0xFF;
    stray[2] = 0x5F;  // the object is now 5FFFh
    port_.send(make_frame(id, stray), time_ns);
  }
  port_.send(make_frame(id, message), time_ns);
  if (quirks_.sdo_doubled) port_.send(make_frame(id, message), time_ns);
}

void CanopenSlave::on_sync(const fieldbus::CanFrame& frame, std::int64_t time_ns) {
  if (quirks_.hears_no_sync_in > 0 && ++syncs_ % quirks_.hears_no_sync_in == 0) return;
  if (frame.length != 0) {  // 1019h is 0, so SYNC must have no counter
    raise_error(emcy::sync_length, error_register::communication, time_ns);
    return;
  }
  last_sync_ns_ = time_ns;
  if (!insists()) clear_error(emcy::communication, time_ns);
  if (state_ == NmtState::operational) {
    if (is_lazy(config_.stack)) check_receive_pdos(time_ns, true, false);
    for (auto& receive : receive_) {
      if (receive->waiting) receive->pdo.unpack(receive->data);
      receive->waiting = false;
    }
  }
  application_.on_sync(time_ns);
  if (state_ == NmtState::operational) transmit_on_sync(time_ns);
}

// Handles a receive PDO. A synchronous PDO that comes after the synchronous window (1007h) is ignored. A PDO that is
// too short is refused. If a PDO is too long, its first bytes are used.
void CanopenSlave::on_receive_pdo(Receive& receive, const fieldbus::CanFrame& frame, std::int64_t time_ns) {
  if (frame.length < receive.pdo.length()) {
    return raise_error(emcy::pdo_too_short, error_register::communication, time_ns);
  }
  // A CAN FD frame may be longer than the mapped bytes, because it is padded to the next valid length.
  if (frame.length > fieldbus::padded_length(receive.pdo.length(), config_.fd)) {
    raise_error(emcy::pdo_too_long, error_register::communication, time_ns);
  } else {
    clear_error(emcy::pdo_too_long, time_ns);
  }
  clear_error(emcy::pdo_too_short, time_ns);
  receive.last_ns = time_ns;
  if (!latches()) clear_error(emcy::rpdo_timeout, time_ns);  // clears also an error from before the PDO was configured
  receive.overdue = false;
  const std::int64_t window_ns = sync_window_->number() * 1'000;
  if (!receive.pdo.synchronous()) return receive.pdo.unpack(frame.bytes());
  if (window_ns > 0 && last_sync_ns_ != never && time_ns - last_sync_ns_ > window_ns) return;
  receive.data = frame.data;
  receive.waiting = true;
}

void CanopenSlave::on_heartbeat(std::uint8_t node, const fieldbus::CanFrame& frame, std::int64_t time_ns) noexcept {
  if (frame.length != 1 || frame.data[0] == 0) return;  // a boot-up message doesn't count as a heartbeat
  for (Consumer& consumer : consumers_) {
    if (consumer.limit_ns == 0 || consumer.node != node) continue;
    consumer.last_ns = time_ns;
    consumer.lost = false;
  }
  if (hears_all() && !latches() && !insists()) clear_error(emcy::heartbeat_lost, time_ns);
}

bool CanopenSlave::hears_all() const noexcept {
  return std::none_of(consumers_.begin(), consumers_.end(), [](const Consumer& c) { return c.lost; });
}

void CanopenSlave::acknowledge(std::int64_t time_ns) noexcept {
  if (!latches()) return;
  if (hears_all()) clear_error(emcy::heartbeat_lost, time_ns);
  if (std::none_of(receive_.begin(), receive_.end(), [](const auto& r) { return r->overdue; })) {
    clear_error(emcy::rpdo_timeout, time_ns);
  }
}

// ---- Time

void CanopenSlave::on_time(std::int64_t time_ns) noexcept {
  if (state_ == NmtState::initialising) {
    if (boot_ns_ == never || time_ns < boot_ns_) return;
    boot_ns_ = never;
    send_state(NmtState::initialising, time_ns);
    heartbeat_ns_ = time_ns;
    enter(NmtState::pre_operational, time_ns);
  }
  if (heartbeat_period_ns_ > 0 && time_ns >= heartbeat_ns_) {
    send_state(state_, time_ns);
    heartbeat_ns_ += heartbeat_period_ns_;
    if (heartbeat_ns_ <= time_ns) heartbeat_ns_ = time_ns + heartbeat_period_ns_;
  }
  if (time_ns - last_sdo_ns_ > sdo_timeout) sdo_.reset();
  check_heartbeats(time_ns);
  check_life_guarding(time_ns);
  const bool lazy = is_lazy(config_.stack);
  if (lazy && talks()) check_sync(time_ns);
  if (state_ != NmtState::operational) return;
  check_receive_pdos(time_ns, !lazy, true);
  if (state_ == NmtState::operational) transmit_events(time_ns);
}

void CanopenSlave::check_heartbeats(std::int64_t time_ns) {
  for (Consumer& consumer : consumers_) {
    if (consumer.limit_ns == 0 || consumer.last_ns == never || consumer.lost) continue;
    if (time_ns - consumer.last_ns <= consumer.limit_ns) continue;
    consumer.lost = true;
    raise_error(emcy::heartbeat_lost, error_register::communication, time_ns);
    application_.on_communication_lost(emcy::heartbeat_lost, time_ns);
    error_behaviour(time_ns);
  }
}

// Answers a node guarding request. A node that produces heartbeats doesn't answer (CiA 301).
void CanopenSlave::on_guard_request(std::int64_t time_ns) noexcept {
  if (heartbeat_period_ns_ > 0) return;
  last_guard_ns_ = time_ns;
  if (life_lost_ && !latches() && !insists()) clear_error(emcy::heartbeat_lost, time_ns);
  life_lost_ = false;
  toggle_ = !toggle_;
  const auto byte = static_cast<std::uint8_t>(static_cast<unsigned>(state_) | (toggle_ ? 0U : 0x80U));
  port_.send(make_frame(0x700u + config_.node, {&byte, 1}), time_ns);
}

void CanopenSlave::check_life_guarding(std::int64_t time_ns) {
  const std::int64_t life_ns = dictionary_.number(0x100C) * dictionary_.number(0x100D) * millisecond;
  if (life_ns == 0 || last_guard_ns_ == never || life_lost_ || time_ns - last_guard_ns_ <= life_ns) return;
  life_lost_ = true;
  raise_error(emcy::heartbeat_lost, error_register::communication, time_ns);
  application_.on_communication_lost(emcy::heartbeat_lost, time_ns);
  error_behaviour(time_ns);
}

// Checks for a missing SYNC in a lazy stack, which only reports the error.
void CanopenSlave::check_sync(std::int64_t time_ns) {
  const std::int64_t period_ns = dictionary_.number(0x1006) * 1'000;
  if (period_ns == 0 || last_sync_ns_ == never || time_ns - last_sync_ns_ <= period_ns + period_ns / 2) return;
  raise_error(emcy::communication, error_register::communication, time_ns);
}

void CanopenSlave::check_receive_pdos(std::int64_t time_ns, bool synchronous, bool others) {
  for (auto& receive : receive_) {
    const std::int64_t limit_ns = receive->pdo.event_timer_ns();
    if (!(receive->pdo.synchronous() ? synchronous : others)) continue;
    if (limit_ns == 0 || !receive->pdo.valid() || receive->overdue || receive->last_ns == never) continue;
    if (time_ns - receive->last_ns <= limit_ns) continue;
    receive->overdue = true;
    raise_error(emcy::rpdo_timeout, error_register::communication, time_ns);
    application_.on_communication_lost(emcy::rpdo_timeout, time_ns);
  }
}

// Reacts to a communication error as 1029h:01 says. 0: from operational to pre-operational; 1: no change; 2: to
// stopped.
void CanopenSlave::error_behaviour(std::int64_t time_ns) {
  const std::int64_t behaviour = dictionary_.number(0x1029, 1);
  if (behaviour == 0 && state_ == NmtState::operational) enter(NmtState::pre_operational, time_ns);
  if (behaviour == 2 && talks()) enter(NmtState::stopped, time_ns);
}

// ---- Transmit PDOs

// Sends synchronous PDOs. Types 1..240: with every n-th SYNC; type 0: with the next SYNC after a change.
void CanopenSlave::transmit_on_sync(std::int64_t time_ns) noexcept {
  for (auto& pdo : transmit_) {
    if (!pdo->pdo.valid() || !pdo->pdo.synchronous()) continue;
    std::array<std::uint8_t, 64> data{};
    pdo->pdo.pack(data);
    const int every = pdo->pdo.transmission_type();
    const bool changed = pdo->last_ns == never || data != pdo->last;
    if (every == 0 ? changed : ++pdo->syncs >= every) transmit(*pdo, data, time_ns + config_.pdo_answer_time_ns);
  }
}

// Sends PDOs of types 254 and 255: after a change of their data, but not within the inhibit time after the last
// transmission; and when the event timer expires.
void CanopenSlave::transmit_events(std::int64_t time_ns) noexcept {
  for (auto& pdo : transmit_) {
    if (!pdo->pdo.valid() || pdo->pdo.synchronous()) continue;
    std::array<std::uint8_t, 64> data{};
    pdo->pdo.pack(data);
    const bool first = pdo->last_ns == never;
    const std::int64_t since_ns = first ? 0 : time_ns - pdo->last_ns;
    const bool changed = data != pdo->last && since_ns >= pdo->pdo.inhibit_ns();
    const bool due = pdo->pdo.event_timer_ns() > 0 && since_ns >= pdo->pdo.event_timer_ns();
    if (first || changed || due) transmit(*pdo, data, time_ns);
  }
}

void CanopenSlave::transmit(Transmit& pdo, const std::array<std::uint8_t, 64>& data, std::int64_t time_ns) noexcept {
  pdo.last = data;
  pdo.last_ns = time_ns;
  pdo.syncs = 0;
  const int bytes = quirks_.tpdo_bytes < 0 ? pdo.pdo.length() : quirks_.tpdo_bytes;
  const auto length = static_cast<std::size_t>(fieldbus::padded_length(bytes, config_.fd));
  fieldbus::CanFrame frame = make_frame(pdo.pdo.identifier(), {data.data(), length});
  frame.fd = frame.bit_rate_switch = config_.fd;
  port_.send(frame, time_ns);
  if (!quirks_.has_twin) return;
  frame.data[2] ^= 0x40U;  // changes the position
  port_.send(frame, time_ns);
}

// ---- Heartbeat consumer, 1016h: reserved u8 | node u8 | time in ms u16

SdoAbort CanopenSlave::check_consumer(std::uint8_t subindex, std::int64_t value) const noexcept {
  const std::int64_t node = value >> 16 & 0xFF;
  if (value >> 24 != 0 || node > 127) return SdoAbort::invalid_value;
  if ((value & 0xFFFF) == 0 || node == 0) return SdoAbort::none;  // the consumer is unused
  for (std::uint8_t i = 1; i <= consumers; ++i) {
    const std::int64_t other = dictionary_.number(0x1016, i);
    if (i != subindex && (other & 0xFFFF) != 0 && (other >> 16 & 0xFF) == node) {
      return SdoAbort::parameter_incompatibility;
    }
  }
  return SdoAbort::none;
}

void CanopenSlave::configure_consumers() noexcept {
  for (std::uint8_t i = 0; i < consumers; ++i) {
    const std::int64_t value = dictionary_.number(0x1016, static_cast<std::uint8_t>(i + 1));
    const auto node = static_cast<std::uint8_t>(value >> 16 & 0xFF);
    const std::int64_t limit_ns = node == 0 ? 0 : (value & 0xFFFF) * millisecond;
    if (consumers_[i].node == node && consumers_[i].limit_ns == limit_ns) continue;
    consumers_[i] = {node, limit_ns, never, false};
  }
}

// ---- EMCY

bool CanopenSlave::has_error(std::uint16_t code) const noexcept {
  return std::any_of(errors_.begin(), errors_.end(), [code](const Error& e) { return e.code == code; });
}

void CanopenSlave::raise_error(std::uint16_t code, std::uint8_t register_bits, std::int64_t time_ns) noexcept {
  if (has_error(code)) return;
  errors_.push_back({code, static_cast<std::uint8_t>(register_bits | error_register::generic)});
  for (std::uint8_t i = 8; i > 1; --i) {  // the newest error comes first
    dictionary_.at(0x1003, i).set(dictionary_.number(0x1003, static_cast<std::uint8_t>(i - 1)));
  }
  dictionary_.at(0x1003, 1).set(code);
  dictionary_.at(0x1003, 0).set(std::min<std::int64_t>(dictionary_.number(0x1003, 0) + 1, 8));
  send_emergency(code, time_ns);
}

void CanopenSlave::clear_error(std::uint16_t code, std::int64_t time_ns) noexcept {
  if (!has_error(code)) return;
  std::erase_if(errors_, [code](const Error& e) { return e.code == code; });
  send_emergency(errors_.empty() ? emcy::no_error : errors_.back().code, time_ns);
}

// Sends an EMCY: code u16 | error register u8 | five bytes that the maker defines, here 0
void CanopenSlave::send_emergency(std::uint16_t code, std::int64_t time_ns) noexcept {
  std::uint8_t bits = 0;
  for (const Error& error : errors_) bits = static_cast<std::uint8_t>(bits | error.register_bits);
  dictionary_.at(0x1001).set(bits);
  const std::array<std::uint8_t, 8> bytes{
      static_cast<std::uint8_t>(code), static_cast<std::uint8_t>(code >> 8), bits, 0, 0, 0, 0, 0};
  if (talks()) port_.send(make_frame(0x80u + config_.node, bytes), time_ns);
}

void CanopenSlave::say_warning(std::uint16_t code, std::int64_t time_ns) noexcept {
  const std::array<std::uint8_t, 8> bytes{static_cast<std::uint8_t>(code), static_cast<std::uint8_t>(code >> 8)};
  if (talks()) port_.send(make_frame(0x80u + config_.node, bytes), time_ns);
}

}  // namespace proxarm::sim
