// libFuzzer: whatever frames come in whatever order and at whatever times, a described sensor gives finite numbers, and
// counts each sample once. The description has a header, bit fields, a counter, a status and a checksum; the first byte
// chooses whether it is polled.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "fieldbus/sensors/described_sensor.hpp"
#include "models/files/yaml_file.hpp"

namespace description = proxarm::description;
using proxarm::fieldbus::CanFrame;
using proxarm::fieldbus::DescribedSensor;

namespace {

description::SensorDescription written(const char* mode) {
  const std::string text = std::string(R"(
name: fuzz
protocol: described
force_range_N: [300, 300, 300]
torque_range_Nm: [30, 30, 30]
frames:
  - {id: 0x100, bytes: 8, starts_with: [0xAA, 0x07]}
  - {id: 0x100, bytes: 8}
  - {id: 0x101, bytes: 3}
counter: {byte: 2, bits: 4}
status: {byte: 3, bits: 8, error_mask: 0xF0, overload_mask: 0x0F}
checksum: {kind: xor8, byte: 18, from: 0, to: 18}
signals:
  fx: {byte: 4, bits: 16, type: signed, scale: 0.01}
  fy: {byte: 6, bits: 16, type: signed, scale: 0.01, byte_order: little_endian}
  fz: {byte: 8, bits: 12, shift: 4, type: signed, scale: 0.1}
  tx: {byte: 9, bits: 12, type: signed, scale: 0.01}
  ty: {byte: 11, bits: 32, type: signed, scale: 0.00001}
  tz: {byte: 15, bits: 24, scale: 0.000001}
)") + mode;
  return description::read_sensor(description::YamlNode::parse(text, "fuzz.yaml"));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const description::SensorDescription polled = written("poll: {id: 0x102, data: []}\n");
  static const description::SensorDescription streaming = written("rate_Hz: 1000\n");
  if (size == 0) return 0;
  DescribedSensor sensor(data[0] % 2 == 0 ? polled : streaming, {.bus_name = "fuzz"});
  std::int64_t now_ns = 0;
  std::uint64_t samples = 0;
  CanFrame request;
  sensor.poll(now_ns, request);
  // Of each frame: a byte of kind and time, a length, the data.
  for (std::size_t at = 1; at + 2 <= size;) {
    const std::uint8_t kind = data[at], length = data[at + 1] % 9;
    at += 2;
    now_ns += 20'000 * (kind >> 3);
    if ((kind & 4) != 0) sensor.poll(now_ns, request);
    CanFrame frame;
    frame.id = 0x100U + (kind & 1U);
    frame.extended = (kind & 3U) == 3;
    frame.length = length;
    for (std::size_t i = 0; i < length && at < size; ++i) frame.data[i] = data[at++];
    sensor.on_frame(frame, now_ns);
    if (sensor.latest().number > samples + 1) std::abort();
    samples = sensor.latest().number;
    for (const double x : sensor.latest().wrench_S) {
      if (!std::isfinite(x)) std::abort();
    }
  }
  return 0;
}
