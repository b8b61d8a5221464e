#include "fieldbus/simulated/simulated_can_network.hpp"

#include <algorithm>
#include <cerrno>
#include <ctime>
#include <limits>
#include <string>

#include "models/base/setup_error.hpp"

namespace proxarm::fieldbus {

using description::SetupError;

SimulatedCanNetwork::SimulatedCanNetwork(const std::vector<SimulatedBusConfig>& buses) {
  events_.reserve(256);
  for (const SimulatedBusConfig& config : buses) {
    for (const auto& other : buses_) {
      if (other->name() == config.name) {
        throw SetupError({.bus = config.name, .message = "two buses have this name"});
      }
    }
    buses_.push_back(std::make_unique<SimulatedCanBus>(config, buses_.size(), events_, frames_waiting_));
  }
}

SimulatedCanNetwork::~SimulatedCanNetwork() = default;

SimulatedCanBus& SimulatedCanNetwork::simulated_bus(std::string_view name) {
  std::string names;
  for (const auto& bus : buses_) {
    if (bus->name() == name) return *bus;
    names += (names.empty() ? "" : ", ") + bus->name();
  }
  throw SetupError({.bus = std::string(name), .message = "no such bus", .expected = names});
}

void SimulatedCanNetwork::apply(const FaultScript& script) {
  for (const FaultRule& rule : script.rules) {
    if (!rule.bus.empty()) {
      simulated_bus(rule.bus).add_fault(rule);
      continue;
    }
    const bool fails_port = rule.action == FaultAction::bus_off || rule.action == FaultAction::port_down ||
                            rule.action == FaultAction::error_passive;
    const std::string& port = fails_port ? rule.port : rule.receiver;
    bool found = false;
    for (const auto& bus : buses_) {
      if (!port.empty() && !bus->has_port(port)) continue;
      bus->add_fault(rule);
      found = true;
    }
    if (!found) {
      throw SetupError({.key = fails_port ? "fault rule: port" : "fault rule: receiver",
                        .found = description::in_quotes(port),
                        .expected = "the name of a node on one of the buses, or controller"});
    }
  }
}

void SimulatedCanNetwork::set_observer(const WireObserver& observer) {
  for (const auto& bus : buses_) bus->set_observer(observer);
}

namespace {
std::int64_t monotonic_ns() noexcept {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return std::int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec;
}
}  // namespace

void SimulatedCanNetwork::follow_real_time() {
  real_time_ = true;
  real_time_offset_ns_ = monotonic_ns() - now_ns();
  // The largest value, so that the first lateness doesn't count as a gap.
  woken_late_ns_ = std::numeric_limits<std::int64_t>::max();
}

std::int64_t SimulatedCanNetwork::behind_ns() const noexcept {
  return real_time_ ? std::max<std::int64_t>(0, monotonic_ns() - real_time_offset_ns_ - now_ns()) : 0;
}

void SimulatedCanNetwork::pace(std::int64_t time_ns) noexcept {
  const std::int64_t until = time_ns + real_time_offset_ns_;
  if (monotonic_ns() >= until) return;
  const timespec when{static_cast<std::time_t>(until / 1'000'000'000), static_cast<long>(until % 1'000'000'000)};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &when, nullptr) == EINTR) {
  }
}

void SimulatedCanNetwork::sleep_until(std::int64_t deadline_ns) noexcept {
  if (!real_time_) {
    events_.run_until(deadline_ns);
    return;
  }
  while (events_.next_time() <= deadline_ns) {
    pace(events_.next_time());
    events_.run_next(deadline_ns);
  }
  pace(deadline_ns);
  events_.advance_to(deadline_ns);
  live_through_gap();
}

// If the machine had a gap, runs the events of the gap. A gap is lateness that arose during the last sleep. Lateness
// that grows over many sleeps comes from a slow machine and is no gap.
void SimulatedCanNetwork::live_through_gap() noexcept {
  const std::int64_t before_ns = woken_late_ns_;
  woken_late_ns_ = behind_ns();
  if (woken_late_ns_ - before_ns <= longest_catch_up_ns) return;
  events_.run_until(now_ns() + std::min(woken_late_ns_, longest_gap_ns));
  real_time_offset_ns_ = monotonic_ns() - now_ns();
}

bool SimulatedCanNetwork::wait_for_frame(std::int64_t deadline_ns) noexcept {
  if (frames_waiting_ > 0) return true;
  const std::int64_t begun_ns = monotonic_ns();
  while (frames_waiting_ == 0) {
    if (real_time_) pace(std::min(events_.next_time(), deadline_ns));
    if (events_.run_next(deadline_ns)) continue;
    events_.advance_to(deadline_ns);
    break;
  }
  waited_ns_ += monotonic_ns() - begun_ns;
  return frames_waiting_ > 0;
}

}  // namespace proxarm::fieldbus
