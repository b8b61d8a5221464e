#include "fieldbus/simulated_can_bus.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include "models/description/setup_error.hpp"

namespace proxarm::fieldbus {
namespace {

using description::SetupError;

constexpr std::uint64_t no_frame = std::numeric_limits<std::uint64_t>::max();
constexpr int error_frame_bits = 17;  // error flag 6, delimiter 8, interframe space 3: after the frame itself

// The bits of arbitration, first on the wire = most significant; the lowest number wins. Up to the BRS bit:
//   11-bit: id 11, RTR, IDE 0, FDF
//   29-bit: id 11, SRR 1, IDE 1, id 18, RTR, FDF
std::uint64_t arbitration_key(const CanFrame& frame) noexcept {
  const std::uint64_t remote = frame.remote ? 1 : 0, fd = frame.fd ? 1 : 0;
  if (!frame.extended) return (std::uint64_t{frame.id} << 22) | (remote << 21) | (fd << 19);
  const std::uint64_t base = frame.id >> 18, extension = frame.id & 0x3ffff;
  return (base << 22) | (3ull << 20) | (extension << 2) | (remote << 1) | fd;
}

// What a rule does to the content of a frame that it matches.
void alter(CanFrame& frame, const FaultRule& rule) noexcept {
  if (rule.action == FaultAction::corrupt) {
    for (const BitFlip flip : rule.flips) {
      if (flip.byte < frame.length) frame.data[flip.byte] ^= static_cast<std::uint8_t>(1u << (flip.bit & 7u));
    }
  } else if (rule.action == FaultAction::resize && is_valid_length(rule.length, frame.fd)) {
    for (std::size_t i = rule.length; i < frame.data.size(); ++i) frame.data[i] = 0;
    frame.length = rule.length;
  }
}

bool fails_a_port(FaultAction action) noexcept {
  return action == FaultAction::bus_off || action == FaultAction::port_down || action == FaultAction::error_passive;
}

BusState failed_state(FaultAction action) noexcept {
  return action == FaultAction::bus_off     ? BusState::bus_off
         : action == FaultAction::port_down ? BusState::down
                                            : BusState::error_passive;
}

bool is_off(BusState state) noexcept { return state == BusState::bus_off || state == BusState::down; }

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

class SimulatedCanBus::Port final : public CanPort {
 public:
  struct Queued {
    CanFrame frame;
    std::int64_t time_ns = 0;
  };

  Port(SimulatedCanBus& bus, std::string name, CanListener* listener, std::size_t queue_length)
      : name_(std::move(name)), listener_(listener), queue_(queue_length + 1), bus_(bus) {}

  SendResult send(const CanFrame& frame) noexcept override { return bus_.queue_frame(*this, frame); }

  bool push(const CanFrame& frame, std::int64_t time_ns) noexcept {
    if (!queue_.push({frame, time_ns})) return false;
    if (queue_.size() == 1) key_ = arbitration_key(frame);
    return true;
  }
  void pop() noexcept {
    queue_.pop();
    key_ = queue_.empty() ? no_frame : arbitration_key(queue_.front().frame);
  }
  void purge() noexcept {
    queue_.clear();
    key_ = no_frame;
  }
  [[nodiscard]] const Queued& head() const noexcept { return queue_.front(); }
  [[nodiscard]] std::size_t queue_size() const noexcept { return queue_.size(); }
  [[nodiscard]] std::uint64_t key() const noexcept { return key_; }  // of the head; no_frame: nothing to send
  [[nodiscard]] const std::string& name() const noexcept { return name_; }
  [[nodiscard]] CanListener* listener() const noexcept { return listener_; }
  [[nodiscard]] BusState state() const noexcept { return state_; }
  void set_state(BusState state) noexcept { state_ = state; }

 private:
  std::uint64_t key_ = no_frame;
  BusState state_ = BusState::error_active;
  std::string name_;
  CanListener* listener_;  // nullptr: the controller, or a babbling node
  RingBuffer<Queued> queue_;
  SimulatedCanBus& bus_;
};

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
  change_state(*port, state);
  return true;
}

void SimulatedCanBus::change_state(Port& port, BusState state) noexcept {
  if (is_off(state)) {
    port.purge();
    if (sender_ == &port) sender_ = nullptr;  // its frame is cut off: nobody receives it
  }
  port.set_state(state);
  if (&port == ports_.front().get()) {
    if (state == BusState::bus_off && status_.state != state) ++status_.error_frames;
    status_.state = state;
  }
}

// An event rather than a call: everything that happens at this same moment may still enter the arbitration.
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

void SimulatedCanBus::arbitrate() {
  arbitration_requested_ = false;
  Port* winner = arbitration_winner();
  if (winner == nullptr) return;
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

void SimulatedCanBus::pick_faults() noexcept {
  for (std::size_t i = 0; i < faults_.size(); ++i) {
    const FaultRule& rule = faults_[i].rule;
    if (rule.action == FaultAction::duplicate && repeating_) continue;
    if (current_start_ns_ < rule.from_ns || current_start_ns_ >= rule.to_ns) continue;
    if ((current_.id & rule.mask) != (rule.id & rule.mask)) continue;
    const std::uint64_t number = ++faults_[i].seen;
    if (number < rule.first || number - rule.first >= rule.count) continue;
    matched_.push_back(i);
    if (rule.receiver.empty()) alter(current_, rule);
    if (rule.action == FaultAction::destroy) idle_ns_ += error_frame_ns_;
  }
}

// End of the EOF field: all receive, then the next arbitration.
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

void SimulatedCanBus::deliver_to(Port& port) {
  if (matched_.empty()) {
    deliver(port, current_);
    return;
  }
  CanFrame frame = current_;
  std::int64_t delay_ns = 0;
  for (const std::size_t i : matched_) {
    const FaultRule& rule = faults_[i].rule;
    if (!rule.receiver.empty() && rule.receiver != port.name()) continue;
    if (rule.action == FaultAction::drop) return;
    if (rule.action == FaultAction::delay) delay_ns += rule.delay_ns;
    if (!rule.receiver.empty()) alter(frame, rule);
  }
  if (delay_ns > 0) {
    deliver_later(port, frame, delay_ns);
  } else {
    deliver(port, frame);
  }
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

void SimulatedCanBus::deliver_later(Port& port, const CanFrame& frame, std::int64_t delay_ns) {
  if (free_delayed_.empty()) {
    delayed_.emplace_back();
    free_delayed_.reserve(delayed_.capacity());
    free_delayed_.push_back(delayed_.size() - 1);
  }
  const std::size_t place = free_delayed_.back();
  free_delayed_.pop_back();
  delayed_[place] = {frame, &port};
  events_.schedule_after(delay_ns, [this, place] {
    const DelayedFrame late = delayed_[place];
    free_delayed_.push_back(place);
    deliver(*late.receiver, late.frame);
  });
}

void SimulatedCanBus::add_fault(const FaultRule& rule) {
  const auto check_port = [this](const std::string& port, const char* key) {
    if (find_port(port) != nullptr) return;
    std::string names;
    for (const auto& known : ports_) names += (names.empty() ? "" : ", ") + known->name();
    throw SetupError({.bus = config_.name,
                      .key = std::string("fault rule: ") + key,
                      .found = description::in_quotes(port),
                      .expected = "a port of this bus: " + names});
  };
  if (!rule.receiver.empty()) check_port(rule.receiver, "receiver");
  if (fails_a_port(rule.action)) {
    check_port(rule.port, "port");
    Port* port = find_port(rule.port);
    events_.schedule(rule.from_ns, [this, port, state = failed_state(rule.action)] { change_state(*port, state); });
    if (rule.to_ns != FaultRule::forever) {
      events_.schedule(rule.to_ns, [this, port] { change_state(*port, BusState::error_active); });
    }
  } else if (rule.action == FaultAction::babble) {
    babble(rule);
  } else {
    faults_.push_back({rule, 0});
    matched_.reserve(faults_.size());
  }
}

void SimulatedCanBus::babble(const FaultRule& rule) {
  if (rule.period_ns <= 0 || !can_carry(rule.frame)) {
    throw SetupError({.bus = config_.name,
                      .key = "fault rule: babble",
                      .message = "needs a period above 0 and a frame that this bus can carry"});
  }
  Port* port = ports_.emplace_back(std::make_unique<Port>(*this, "babbling node", nullptr, 1)).get();
  // Kept among the faults for its frame; the empty time window keeps it from matching any.
  ActiveFault fault{rule, 0};
  fault.rule.first = std::numeric_limits<std::uint64_t>::max();
  faults_.push_back(fault);
  matched_.reserve(faults_.size());
  events_.schedule(rule.from_ns, [this, place = faults_.size() - 1, port] { babble_once(place, *port); });
}

void SimulatedCanBus::babble_once(std::size_t fault, Port& port) {
  const FaultRule& rule = faults_[fault].rule;
  if (events_.now_ns() >= rule.to_ns) return;
  port.send(rule.frame);
  events_.schedule_after(rule.period_ns, [this, fault, &port] { babble_once(fault, port); });
}

}  // namespace proxarm::fieldbus
