// Datagrams from whoever has the sensor's address: read without harm, and a sample is finite and of a datagram of the
// right length. If that datagram was its cycle's only one, its number isn't that of the sample before. The first signal
// is read from the number's own bytes, so each sample shows its number.
//
// Input: pieces of one byte (length) and so many bytes; a length of FFh ends a cycle.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <deque>
#include <memory>

#include "fieldbus/udp/datagram_sensor.hpp"

using namespace proxarm;
using fieldbus::Datagram;

namespace {

std::deque<Datagram> waiting;

class FuzzedPort final : public fieldbus::DatagramPort {
 public:
  bool send(std::span<const std::uint8_t>) noexcept override { return true; }
  bool receive(Datagram& out, std::int64_t) noexcept override {
    if (waiting.empty()) return false;
    out = waiting.front();
    waiting.pop_front();
    return true;
  }
};

description::SensorDescription net_ft() {
  description::SensorDescription sensor;
  sensor.name = "fuzzed";
  sensor.protocol = "described";
  sensor.force_range_N = sensor.torque_range_Nm = {300.0, 300.0, 300.0};
  description::SensorProtocol& protocol = sensor.described.emplace();
  protocol.fd = true;
  protocol.datagrams = description::SensorDatagrams{.port = 49152};
  protocol.frames = {{.id = 1, .bytes = 36, .starts_with = {}}};
  protocol.counter = description::NumberField{.byte = 0, .bits = 32};
  protocol.status = description::SensorStatus{.number = {.byte = 8, .bits = 32}, .bits_named = {}};
  for (std::size_t i = 0; i < 6; ++i) {
    description::SensorSignal signal;
    signal.number = {.byte = i == 0 ? 0 : 12 + 4 * i, .bits = 32, .kind = description::NumberKind::signed_integer};
    signal.scale = 1e-6;
    signal.saturated_below = signal.number.lowest();
    signal.saturated_above = signal.number.highest();
    protocol.signals.push_back(signal);
  }
  protocol.rate_Hz = 1000.0;
  protocol.start = protocol.stop = description::SensorCommand{.id = 1, .data = {1}, .value = {}};
  return sensor;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  waiting.clear();
  fieldbus::DatagramSensor sensor(net_ft(), std::make_unique<FuzzedPort>(), {.peer = "fuzzed"});
  std::int64_t now_ns = 1'000'000'000;
  std::size_t right = 0;
  bool flooded = false;
  for (std::size_t at = 0; at < size;) {
    const std::uint8_t length = data[at++];
    if (length != 0xFF) {
      Datagram datagram;
      datagram.bytes = std::min({std::size_t{length}, datagram.data.size(), size - at});
      std::copy_n(data + at, datagram.bytes, datagram.data.begin());
      datagram.time_ns = now_ns;
      at += datagram.bytes;
      right += datagram.bytes == 36 ? 1 : 0;
      waiting.push_back(datagram);
      continue;
    }
    const fieldbus::ForceSample before = sensor.latest();
    fieldbus::CanFrame frame;
    flooded = flooded || waiting.size() > std::size_t{fieldbus::DatagramSensor::flood};
    if (sensor.poll(now_ns, frame)) std::abort();
    now_ns += 1'000'000;
    if (sensor.fresh() != (sensor.latest().number == before.number + 1)) std::abort();
    if (sensor.fresh() && right == 0) std::abort();
    // A flood's numbers are noted, but it makes no sample.
    const bool same_number = before.number > 0 && sensor.latest().wrench_S[0] == before.wrench_S[0];
    if (sensor.fresh() && right == 1 && same_number && !flooded) std::abort();
    right = 0;
    for (const double value : sensor.latest().wrench_S) {
      if (!std::isfinite(value) || std::abs(value) > 2147.5) std::abort();
    }
  }
  return 0;
}
