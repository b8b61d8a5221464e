#include "fieldbus/simulated/simulated_can_bus.hpp"

#include <algorithm>
#include <utility>

#include "fieldbus/simulated/simulated_can_port.hpp"
#include "models/base/setup_error.hpp"

namespace proxarm::fieldbus {
namespace {

using description::SetupError;

constexpr int error_frame_bits = 17;  // after a destroyed frame: error flag 6, delimiter 8, interframe space 3

void check(const SimulatedBusConfig& config) {
  const auto refuse = [&config](const char* key, std::int64_t found, const char* expected) {
    throw SetupError({.bus = config.name, .key = key, .found = std::to_string(found), .expected = expected});
  };
  if (config.bitrate < 10'000 || config.bitrate > 1'000'000)
    refuse("bitrate", config.bitrate, "10000 to 1000000 bit/s");
  if (config.data_bitrate != 0 && (config.data_bitrate < config.bitrate || config.data_bitrate > 8'000'000)) {
    refuse("data_bitrate", config.data_bitrate, "0 (no CAN FD), or the bitrate to 8000000 bit/s");
  }
  if (config.receive_queue_length == 0) refuse("receive_queue_length", 0, "at least 1 frame");
}

}  // namespace

SimulatedCanBus::SimulatedCanBus(SimulatedBusConfig config, std::size_t index, EventQueue& events,
                                 std::size_t& frames_waiting)
    : config_((check(config), std::move(config))),
      index_(index),
      events_(events),
      frames_waiting_(frames_waiting),
      rates_{config_.bitrate, config_.data_bitrate},
      interframe_ns_(wire_time_ns(WireBits{can_interframe_bits, 0}, rates_)),
      error_frame_ns_(wire_time_ns(WireBits{error_frame_bits, 0}, rates_)),
      statistics_(config_.load_window_ns),
      received_(config_.receive_queue_length) {
  ports_.push_back(std::make_unique<Port>(*this, "controller", nullptr, config_.transmit_queue_length));
}

SimulatedCanBus::~SimulatedCanBus() = default;

CanPort& SimulatedCanBus::attach(CanListener& listener, std::string name, NodeFormat format) {
  const bool fd_bus = config_.data_bitrate > 0;
  if (find_port(name) != nullptr) {
    throw SetupError({.bus = config_.name, .message = "a node named \"" + name + "\" is on this bus already"});
  }
  if (format == NodeFormat::classic && fd_bus) {
    throw SetupError({.bus = config_.name,
                      .message = "node \"" + name + "\" is classic CAN but the bus carries CAN FD: the node would " +
                                 "answer every FD frame with an error frame",
                      .advice = "put it on a bus of its own, or leave data_bitrate out"});
  }
  if (format == NodeFormat::fd && !fd_bus) {
    throw SetupError({.bus = config_.name,
                      .message = "node \"" + name + "\" sends CAN FD but the bus is classic: the others would answer " +
                                 "its frames with error frames",
                      .advice = "give the bus a data_bitrate, with FD nodes only on it"});
  }
  ports_.push_back(std::make_unique<Port>(*this, std::move(name), &listener, config_.node_transmit_queue_length));
  if (!transmitting_) request_arbitration();  // frames may have waited for a node to acknowledge them
  return *ports_.back();
}

bool SimulatedCanBus::can_carry(const CanFrame& frame) const noexcept {
  if (frame.error || frame.id > (frame.extended ? 0x1fffffffu : 0x7ffu)) return false;
  if (frame.fd && (config_.data_bitrate == 0 || frame.remote)) return false;
  return is_valid_length(frame.length, frame.fd);
}

SendResult SimulatedCanBus::queue_frame(Port& port, const CanFrame& frame) noexcept {
  if (port.state() == BusState::down) return SendResult::down;
  if (port.state() == BusState::bus_off) return SendResult::bus_off;
  if (!can_carry(frame)) return SendResult::refused;
  if (!port.push(frame, events_.now_ns())) return SendResult::queue_full;
  if (!transmitting_) request_arbitration();
  return SendResult::sent;
}

SendResult SimulatedCanBus::send(const CanFrame& frame) noexcept {
  const SendResult result = queue_frame(*ports_.front(), frame);
  ++(result == SendResult::sent ? status_.frames_sent : status_.send_failures);
  return result;
}

bool SimulatedCanBus::receive(TimedFrame& out) noexcept {
  if (received_.empty()) return false;
  out = received_.front();
  received_.pop();
  --frames_waiting_;
  return true;
}

std::size_t SimulatedCanBus::transmit_queue_size() const noexcept { return ports_.front()->queue_size(); }

SimulatedCanBus::Port* SimulatedCanBus::find_port(std::string_view name) noexcept {
  for (const auto& port : ports_) {
    if (port->name() == name) return port.get();
  }
  return nullptr;
}

bool SimulatedCanBus::has_port(std::string_view name) const noexcept {
  return std::any_of(ports_.begin(), ports_.end(), [name](const auto& port) { return port->name() == name; });
}

bool SimulatedCanBus::set_state(std::string_view port_name, BusState state) noexcept {
  Port* port = find_port(port_name);
  if (port == nullptr) return false;
  force_state(*port, state);
  return true;
}

ErrorCounters SimulatedCanBus::error_counters(std::string_view name) const noexcept {
  for (const auto& port : ports_) {
    if (port->name() == name) return port->errors;
  }
  return {};
}

// Sets a port's state for a fault rule. The state stays until a rule sets it to error active.
void SimulatedCanBus::force_state(Port& port, BusState state) noexcept {
  port.follows_errors = state == BusState::error_active;
  port.errors = {};
  change_state(port, state);
}

void SimulatedCanBus::change_state(Port& port, BusState state) noexcept {
  if (is_off(state)) {
    port.purge();
    if (sender_ == &port) sender_ = nullptr;  // the port's frame on the wire is cut off, so no port receives it
  }
  port.set_state(state);
  if (!is_off(state) && !transmitting_) request_arbitration();  // frames may have waited for a node to acknowledge them
  if (&port == ports_.front().get()) {
    if (state == BusState::bus_off && status_.state != state) ++status_.error_frames;
    status_.state = state;
  }
}

void SimulatedCanBus::count_errors(const Port* sender, bool destroyed) noexcept {
  if (!destroyed && !any_errors_) return;
  any_errors_ = false;
  for (const auto& port : ports_) {
    if (!port->follows_errors || is_off(port->state())) continue;
    ErrorCounters& errors = port->errors;
    if (port.get() == sender) {
      errors.transmit = std::max(0, errors.transmit + (destroyed ? 8 : -1));
    } else {
      errors.receive = destroyed ? std::min(errors.receive + 1, 255) : std::clamp(errors.receive - 1, 0, 127);
    }
    any_errors_ = any_errors_ || errors.transmit > 0 || errors.receive > 0;
    follow_errors(*port);
  }
}

void SimulatedCanBus::follow_errors(Port& port) noexcept {
  const int most = std::max(port.errors.transmit, port.errors.receive);
  const BusState state = port.errors.transmit > 255 ? BusState::bus_off
                         : most >= 128              ? BusState::error_passive
                         : most >= 96               ? BusState::error_warning
                                                    : BusState::error_active;
  if (state == port.state()) return;
  change_state(port, state);
  if (state != BusState::bus_off || config_.restart_ns <= 0) return;
  const std::int64_t recessive_ns = wire_time_ns(WireBits{128 * 11, 0}, rates_);
  events_.schedule_after(config_.restart_ns + recessive_ns, [this, &port] {
    if (port.state() == BusState::bus_off && port.follows_errors) force_state(port, BusState::error_active);
  });
}

// Schedules an event for arbitration. arbitrate() isn't called directly, so that frames queued at the same time can
// still take part.
void SimulatedCanBus::request_arbitration() {
  if (arbitration_requested_) return;
  arbitration_requested_ = true;
  events_.schedule(std::max(idle_ns_, events_.now_ns()), [this] { arbitrate(); });
}

SimulatedCanBus::Port* SimulatedCanBus::arbitration_winner() noexcept {
  Port* winner = nullptr;
  std::uint64_t best = no_frame;
  for (const auto& port : ports_) {
    if (port->key() < best) {
      best = port->key();
      winner = port.get();
    } else if (port->key() == best && best != no_frame) {
      statistics_.add_collision();
    }
  }
  return winner;
}

bool SimulatedCanBus::is_acknowledged(const Port& sender) const noexcept {
  return std::any_of(ports_.begin(), ports_.end(), [&](const auto& port) {
    return port.get() != &sender && !is_off(port->state()) && port->receives();
  });
}

void SimulatedCanBus::arbitrate() {
  arbitration_requested_ = false;
  Port* winner = arbitration_winner();
  if (winner == nullptr) return;
  if (!is_acknowledged(*winner)) {
    // A real controller would repeat the frame without end in the state error passive. This controller waits silently
    // until another node is there.
    if (winner == ports_.front().get() && status_.state != BusState::error_passive) {
      force_state(*winner, BusState::error_passive);
      ++status_.error_frames;
      alone_ = true;
    }
    return;
  }
  if (alone_) {
    alone_ = false;
    force_state(*ports_.front(), BusState::error_active);
  }
  sender_ = winner;
  transmitting_ = true;
  current_ = winner->head().frame;
  current_queued_ns_ = winner->head().time_ns;
  current_start_ns_ = events_.now_ns();
  const WireBits bits = wire_bits(current_);
  idle_ns_ = current_start_ns_ + wire_time_ns(bits, rates_);
  matched_.clear();
  if (!faults_.empty()) pick_faults();
  statistics_.add_frame(current_, bits, current_start_ns_, idle_ns_);
  events_.schedule(idle_ns_ - interframe_ns_, [this] { complete(); });
}

// Ends a frame at the end of its EOF field: delivers the frame to all other ports and requests the next arbitration.
void SimulatedCanBus::complete() {
  bool destroyed = sender_ == nullptr, duplicated = false, dropped = false;
  for (const std::size_t i : matched_) {
    const FaultRule& rule = faults_[i].rule;
    destroyed = destroyed || rule.action == FaultAction::destroy;
    duplicated = duplicated || rule.action == FaultAction::duplicate;
    dropped = dropped || (rule.action == FaultAction::drop && rule.receiver.empty());
  }
  log(destroyed || dropped);
  Port* const sender = sender_;
  sender_ = nullptr;
  if (!destroyed) {
    statistics_.add_response(current_, events_.now_ns() - current_queued_ns_);
    if (!duplicated) sender->pop();
    repeating_ = duplicated;
    if (!dropped) {
      for (const auto& port : ports_) {
        if (port.get() != sender) deliver_to(*port);
      }
    }
  } else {
    repeating_ = false;
    if (!is_off(status_.state)) ++status_.error_frames;
  }
  count_errors(sender, destroyed);
  transmitting_ = false;
  for (const auto& port : ports_) {
    if (port->key() != no_frame) {
      request_arbitration();
      break;
    }
  }
}

void SimulatedCanBus::log(bool lost) const {
  if (!observer_) return;
  const std::string_view sender = sender_ != nullptr ? std::string_view(sender_->name()) : std::string_view();
  observer_({current_, current_queued_ns_, current_start_ns_, events_.now_ns(), index_, config_.name, sender, lost});
}

void SimulatedCanBus::deliver(Port& port, const CanFrame& frame) noexcept {
  if (is_off(port.state())) return;
  if (port.listener() != nullptr) {
    port.listener()->on_frame(frame, events_.now_ns());
  } else if (&port == ports_.front().get()) {
    if (received_.push({frame, events_.now_ns()})) {
      ++status_.frames_received;
      ++frames_waiting_;
    } else {
      ++status_.receive_overflows;
    }
  }
}

}  // namespace proxarm::fieldbus
