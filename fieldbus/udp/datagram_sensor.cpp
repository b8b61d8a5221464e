#include "fieldbus/udp/datagram_sensor.hpp"

#include <algorithm>
#include <utility>

#include "models/base/setup_error.hpp"

namespace proxarm::fieldbus {
namespace {

using description::SetupError;

constexpr std::int64_t look_again_ns = 1'000'000;  // at start

const description::SensorProtocol& checked(const description::SensorDescription& sensor) {
  if (sensor.described && sensor.described->datagrams) return *sensor.described;
  throw SetupError({.file = sensor.file.string(), .key = "datagrams", .expected = "those of a sensor on UDP"});
}

// The decoder sees only the newest datagram of a cycle, so the numbers of datagrams are judged before it.
description::SensorDescription without_counter(description::SensorDescription sensor) {
  sensor.described->counter.reset();
  return sensor;
}

}  // namespace

DatagramSensor::DatagramSensor(const description::SensorDescription& sensor, std::unique_ptr<DatagramPort> port,
                               DatagramSensorSettings settings)
    : protocol_(checked(sensor)),
      name_(sensor.name),
      settings_(std::move(settings)),
      port_(std::move(port)),
      decoder_(without_counter(sensor), {.bus_name = settings_.peer, .oldest_sample_ns = settings_.oldest_ns}),
      sequence_(protocol_) {}

DatagramSensor::~DatagramSensor() {
  if (started_) (void)port_->send(protocol_.stop->data);
}

// ---- Start

// Drops datagrams from before. Without the bound, a sender faster than this loop would keep the session from starting.
void DatagramSensor::empty_port(std::int64_t now_ns) noexcept {
  for (int count = 0; count < flood && port_->receive(read_, now_ns);) ++count;
}

bool DatagramSensor::await_sample(CanNetwork& network) {
  const std::int64_t deadline_ns = network.now_ns() + settings_.answer_timeout_ns;
  CanFrame unused;
  while (network.now_ns() < deadline_ns) {
    poll(network.now_ns(), unused);
    if (decoder_.fresh()) return true;
    network.sleep_until(network.now_ns() + look_again_ns);
  }
  return false;
}

void DatagramSensor::start(CanNetwork& network, std::size_t, const FrameHandler&) {
  bool answered = false;
  started_ = true;
  for (int attempt = 0; attempt < settings_.attempts && !answered; ++attempt) {
    (void)port_->send(protocol_.stop->data);
    network.sleep_until(network.now_ns() + settings_.pause_ns);
    empty_port(network.now_ns());
    sequence_.restart();
    (void)port_->send(protocol_.start->data);
    answered = await_sample(network);
  }
  if (!answered) refuse_start();
  // Datagrams that come while other devices are brought up don't count as lost.
  sequence_.restart();
  sequence_.forget_counts();
  bad_checksums_before_ = decoder_.counts().bad_checksums;
  if (decoder_.latest().healthy) return;
  throw SetupError({.bus = settings_.peer,
                    .message = "force sensor (" + name_ + "), status",
                    .found = decoder_.describe_status(decoder_.latest().status),
                    .expected = "no error",
                    .advice = "the sensor's own web page or manual explains the status"});
}

void DatagramSensor::refuse_start() const {
  const std::string wrong = losses_text({{sequence_.counts().wrong_lengths, "datagrams of a wrong length"},
                                         {decoder_.counts().bad_checksums, "datagrams with a bad checksum"}});
  throw SetupError(
      {.bus = settings_.peer,
       .message = "force sensor (" + name_ + ")",
       .found = wrong.empty() ? "no answer" : wrong,
       .expected = "datagrams of " + std::to_string(protocol_.sample_bytes()) + " bytes",
       .advice = wrong.empty() ? "is it powered, are sensor.host and sensor.port its own, does no firewall drop UDP, "
                                 "and does no other program read it?"
                               : "is it the sensor of the cell's file?"});
}

std::string DatagramSensor::identity() const { return decoder_.identity() + ", UDP " + settings_.peer; }

// ---- Cycle

// Reads what waits in the port. Returns whether newest_ is a datagram that is new in this cycle.
bool DatagramSensor::take_newest(std::int64_t now_ns) noexcept {
  bool took = false;
  for (int count = 0; port_->receive(read_, now_ns); ++count) {
    if (count == flood) {
      ++floods_;
      return false;
    }
    if (read_.time_ns < now_ns - settings_.oldest_ns || !sequence_.accept(read_.view())) continue;
    std::swap(newest_, read_);
    took = true;
  }
  return took;
}

bool DatagramSensor::poll(std::int64_t now_ns, CanFrame& frame) noexcept {
  decoder_.poll(now_ns, frame);
  took_ = std::exchange(restored_, false) ? took_ : take_newest(now_ns);
  if (!took_) return false;
  CanFrame sample;
  sample.id = protocol_.frames.front().id;
  sample.fd = true;
  sample.length = protocol_.frames.front().bytes;
  std::copy_n(newest_.data.begin(), sample.length, sample.data.begin());
  decoder_.on_frame(sample, newest_.time_ns);
  return false;
}

void DatagramSensor::archive_input(StateArchive& state) noexcept {
  state(took_, newest_.data, newest_.time_ns);
  if (state.reading()) restored_ = true;
}

std::string DatagramSensor::describe_losses() const {
  const DatagramCounts& counts = sequence_.counts();
  return losses_text({{counts.wrong_lengths, "datagrams of a wrong length"},
                      {decoder_.counts().bad_checksums - bad_checksums_before_, "datagrams with a bad checksum"},
                      {counts.lost, "datagrams left out by their numbers"},
                      {counts.out_of_order, "datagrams out of order"},
                      {counts.repeated, "datagrams repeated"},
                      {floods_, "cycles flooded with datagrams"}});
}

}  // namespace proxarm::fieldbus
