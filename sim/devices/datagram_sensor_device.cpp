#include "sim/devices/datagram_sensor_device.hpp"

#include <algorithm>
#include <limits>

namespace proxarm::sim {

void DatagramSensorDevice::obey(DescribedDevice& device, std::int64_t time_ns) noexcept {
  fieldbus::Datagram request;
  for (int count = 0; count < most_requests && wire_ != nullptr && wire_->take(request); ++count) {
    fieldbus::CanFrame frame;
    if (request.bytes > frame.data.size()) continue;
    frame.id = 1;
    frame.fd = true;
    frame.length = static_cast<std::uint8_t>(request.bytes);
    std::copy_n(request.data.begin(), request.bytes, frame.data.begin());
    device.on_frame(frame, time_ns);
  }
}

void DatagramSensorDevice::send(const fieldbus::CanFrame& sample, std::int64_t ready_ns) noexcept {
  if (wire_ != nullptr) wire_->send(sample.bytes(), ready_ns);
}

// ---- In this process

bool InProcessPort::Queue::push(std::span<const std::uint8_t> bytes, std::int64_t time_ns) noexcept {
  if (count == room) return false;
  fieldbus::Datagram& last = datagrams[(first + count++) % room];
  last.bytes = std::min(bytes.size(), last.data.size());
  std::copy_n(bytes.begin(), last.bytes, last.data.begin());
  last.time_ns = time_ns;
  return true;
}

bool InProcessPort::Queue::pop(fieldbus::Datagram& out, std::int64_t until_ns) noexcept {
  if (count == 0 || datagrams[first].time_ns > until_ns) return false;
  out = datagrams[first];
  first = (first + 1) % room;
  --count;
  return true;
}

bool InProcessPort::send(std::span<const std::uint8_t> bytes) noexcept { return to_device_.push(bytes, 0); }

bool InProcessPort::receive(fieldbus::Datagram& out, std::int64_t now_ns) noexcept { return to_port_.pop(out, now_ns); }

void InProcessPort::send(std::span<const std::uint8_t> bytes, std::int64_t ready_ns) noexcept {
  to_port_.push(bytes, ready_ns + on_the_way_ns);
}

bool InProcessPort::take(fieldbus::Datagram& request) noexcept {
  return to_device_.pop(request, std::numeric_limits<std::int64_t>::max());
}

}  // namespace proxarm::sim
