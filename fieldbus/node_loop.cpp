#include "fieldbus/node_loop.hpp"

#include <algorithm>

namespace proxarm::fieldbus {
namespace {
constexpr std::size_t local_frames = 256;               // between two steps; more than any queue of an interface takes
constexpr std::int64_t longest_sleep_ns = 100'000'000;  // between two looks at the stop flag
}  // namespace

class NodeLoop::Port final : public CanPort {
 public:
  Port(NodeLoop& loop, std::size_t bus, CanListener& listener) : loop_(loop), bus_(bus), listener_(listener) {}

  SendResult send(const CanFrame& frame) noexcept override {
    const SendResult result = loop_.network_.bus(bus_).send(frame);
    if (result == SendResult::sent && has_neighbour_) loop_.local_.push({frame, this});
    return result;
  }
  [[nodiscard]] std::size_t bus() const noexcept { return bus_; }
  [[nodiscard]] CanListener& listener() const noexcept { return listener_; }
  void set_has_neighbour() noexcept { has_neighbour_ = true; }

 private:
  NodeLoop& loop_;
  std::size_t bus_;
  CanListener& listener_;
  bool has_neighbour_ = false;
};

NodeLoop::NodeLoop(CanNetwork& network) : network_(network), events_(network.now_ns()), local_(local_frames) {
  events_.reserve(256);
}

NodeLoop::~NodeLoop() = default;

CanPort& NodeLoop::attach(std::size_t bus, CanListener& listener) {
  Port& added = *ports_.emplace_back(std::make_unique<Port>(*this, bus, listener));
  for (const auto& port : ports_) {
    if (port.get() == &added || port->bus() != bus) continue;
    port->set_has_neighbour();
    added.set_has_neighbour();
  }
  return added;
}

void NodeLoop::run_until(std::int64_t end_ns) {
  while (network_.now_ns() < end_ns) step(end_ns);
}

void NodeLoop::run(const std::atomic<bool>& stop) {
  while (!stop.load(std::memory_order_relaxed)) step(network_.now_ns() + longest_sleep_ns);
}

void NodeLoop::step(std::int64_t limit_ns) {
  hand_over_local_frames();
  if (network_.wait_for_frame(std::min(events_.next_time(), limit_ns))) take_frames();
  hand_over_local_frames();
  // One event at a time, so that a frame that it makes a neighbour send is heard before the next event.
  const std::int64_t now_ns = network_.now_ns();
  while (events_.run_next(now_ns)) hand_over_local_frames();
  events_.advance_to(now_ns);
}

void NodeLoop::take_frames() {
  TimedFrame timed;
  for (std::size_t bus = 0; bus < network_.bus_count(); ++bus) {
    while (network_.bus(bus).receive(timed)) {
      while (events_.run_next(timed.time_ns - 1)) hand_over_local_frames();
      events_.advance_to(timed.time_ns);
      for (const auto& port : ports_) {
        if (port->bus() == bus) port->listener().on_frame(timed.frame, timed.time_ns);
      }
      hand_over_local_frames();
    }
  }
}

void NodeLoop::hand_over_local_frames() {
  while (!local_.empty()) {
    const LocalFrame local = local_.front();
    local_.pop();
    for (const auto& port : ports_) {
      if (port.get() == local.sender || port->bus() != local.sender->bus()) continue;
      port->listener().on_frame(local.frame, events_.now_ns());
    }
  }
}

}  // namespace proxarm::fieldbus
