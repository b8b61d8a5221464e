// Applies fault rules to the frames and ports of a SimulatedCanBus.
#include <limits>
#include <memory>
#include <string>

#include "fieldbus/simulated/simulated_can_bus.hpp"
#include "fieldbus/simulated/simulated_can_port.hpp"
#include "models/base/setup_error.hpp"

namespace proxarm::fieldbus {
namespace {

using description::SetupError;

// Alters the content of a frame to which the rule applies.
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

}  // namespace

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
    events_.schedule(rule.from_ns, [this, port, state = failed_state(rule.action)] { force_state(*port, state); });
    if (rule.to_ns != FaultRule::forever) {
      events_.schedule(rule.to_ns, [this, port] { force_state(*port, BusState::error_active); });
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
  // The rule is kept in faults_ for the frame that it sends. Its `first` is set to the maximum, so it never matches a
  // frame.
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
