#include "sim/bus/device_node.hpp"

#include <utility>

namespace proxarm::sim {

DeviceNode::DeviceNode(std::string name, std::size_t bus, fieldbus::EventQueue& events, Clockwork& clockwork)
    : name_(std::move(name)), bus_(bus), events_(events), clockwork_(clockwork) {
  constexpr std::size_t usually = 16;  // frames in preparation in normal operation; there may be more
  waiting_.reserve(usually);
  free_places_.reserve(usually);
}

void DeviceNode::set_power(bool on, std::int64_t time_ns) noexcept {
  if (on && !powered_ && device_ != nullptr) device_->power_on(time_ns);
  powered_ = on;
}

void DeviceNode::on_frame(const fieldbus::CanFrame& frame, std::int64_t time_ns) noexcept {
  if (!powered_ || cuts_ > 0 || device_ == nullptr) return;
  clockwork_.advance_to(time_ns);
  clockwork_.seen(frame, time_ns);
  device_->on_frame(frame, time_ns);
}

void DeviceNode::on_time(std::int64_t time_ns) noexcept {
  if (powered_ && device_ != nullptr) device_->on_time(time_ns);
}

void DeviceNode::send(const fieldbus::CanFrame& frame, std::int64_t ready_ns) noexcept {
  if (ready_ns <= events_.now_ns()) return send_now(frame);
  if (free_places_.empty()) {
    free_places_.push_back(static_cast<std::uint32_t>(waiting_.size()));
    waiting_.emplace_back();
  }
  const std::uint32_t place = free_places_.back();
  free_places_.pop_back();
  waiting_[place] = frame;
  events_.schedule(ready_ns, [this, place] { send_waiting(place); });
}

void DeviceNode::send_waiting(std::uint32_t place) noexcept {
  free_places_.push_back(place);
  send_now(waiting_[place]);
}

void DeviceNode::send_now(const fieldbus::CanFrame& frame) noexcept {
  if (!powered_ || cuts_ > 0 || port_ == nullptr) return;
  if (port_->send(frame) == fieldbus::SendResult::sent) {
    ++frames_sent_;
  } else {
    ++frames_not_sent_;
  }
}

}  // namespace proxarm::sim
