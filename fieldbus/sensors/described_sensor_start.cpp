// Commands to a described sensor before the cycle, and its state as text.
#include <algorithm>
#include <cmath>
#include <utility>

#include "fieldbus/canopen/canopen_object.hpp"
#include "fieldbus/sensors/described_sensor.hpp"
#include "models/base/setup_error.hpp"

namespace proxarm::fieldbus {
namespace {

using description::SensorCommand;
using description::SetupError;

void put_number(std::vector<std::uint8_t>& data, const description::NumberField& number, std::uint64_t value) {
  const std::size_t count = number.bytes();
  value <<= number.shift;
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t at = number.byte + (number.big_endian ? count - 1 - i : i);
    data[at] = static_cast<std::uint8_t>(data[at] | (value >> (8 * i) & 0xFF));
  }
}

}  // namespace

DescribedSensor::DescribedSensor(const description::SensorDescription& sensor, DescribedSensorSettings settings)
    : name_(sensor.name), file_(sensor.file.filename().string()), settings_(std::move(settings)) {
  if (!sensor.described) {
    throw SetupError(
        {.file = sensor.file.string(), .key = "protocol", .found = sensor.protocol, .expected = "described"});
  }
  protocol_ = *sensor.described;
  if (settings_.base_id < protocol_.base_id_min || settings_.base_id > protocol_.base_id_max) {
    throw SetupError({.bus = settings_.bus_name,
                      .key = "sensor.base_id",
                      .found = hex_text(settings_.base_id, 2),
                      .expected = protocol_.has_base_id
                                      ? hex_text(protocol_.base_id_min, 2) + " to " + hex_text(protocol_.base_id_max, 2)
                                      : "none: this sensor's identifiers stand in " + file_});
  }
  std::size_t at = 0;
  for (const description::SampleFrame& frame : protocol_.frames) {
    Slot slot;
    slot.id = protocol_.wire_id(frame.id, settings_.base_id);
    slot.bytes = frame.bytes;
    slot.at = static_cast<std::uint16_t>(at);
    slot.head_bytes = static_cast<std::uint8_t>(frame.starts_with.size());
    slot.own_head = slot.head_bytes > 0;
    std::copy(frame.starts_with.begin(), frame.starts_with.end(), slot.head.begin());
    at += frame.bytes;
    slots_.push_back(slot);
  }
  identity_matrix_ = protocol_.matrix_columns.empty();
  for (std::size_t i = 0; i < protocol_.signals.size(); ++i) {
    const description::SensorSignal& signal = protocol_.signals[i];
    Channel channel{slice_of(signal.number), signal.scale,           signal.offset,
                    signal.saturated_below,  signal.saturated_above, Wrench{}};
    if (identity_matrix_) {
      channel.column[i] = 1.0;
    } else {
      channel.column = protocol_.matrix_columns[i];
    }
    channels_.push_back(channel);
  }
  for (std::size_t i = 0; i < 3; ++i) {
    range_[i] = sensor.force_range_N[i];
    range_[i + 3] = sensor.torque_range_Nm[i];
  }
  if (protocol_.counter) counter_ = slice_of(*protocol_.counter);
  if (protocol_.status) status_ = slice_of(protocol_.status->number);
  if (protocol_.checksum) checksum_ = slice_of(protocol_.checksum->number);
  order_is_certain_ = slots_.size() == 1 || protocol_.checksum.has_value();
  streams_ = protocol_.streams();
  together_ns_ = std::llround(1e9 * protocol_.together_s);
  if (protocol_.poll) poll_frame_ = command_frames(*protocol_.poll).front();
  for (const std::uint32_t id : used_ids()) {
    if (id != 0x000 && id != 0x080) continue;
    throw SetupError({.file = protocol_.has_base_id || protocol_.has_settings ? "" : sensor.file.string(),
                      .bus = settings_.bus_name,
                      .key = protocol_.has_base_id    ? "sensor.base_id"
                             : protocol_.has_settings ? "sensor.settings"
                                                      : "frames, poll and commands",
                      .found = "identifier " + hex_text(id, 3) + " for the force sensor",
                      .expected = "one that is neither NMT's (0x000) nor SYNC's (0x080)"});
  }
}

std::vector<std::uint32_t> DescribedSensor::wanted_ids() const {
  std::vector<std::uint32_t> ids;
  const std::uint32_t flag = protocol_.extended ? extended_id_flag : 0;
  for (const Slot& slot : slots_) {
    if (std::find(ids.begin(), ids.end(), slot.id | flag) == ids.end()) ids.push_back(slot.id | flag);
  }
  return ids;
}

std::vector<std::uint32_t> DescribedSensor::used_ids() const {
  std::vector<std::uint32_t> ids = protocol_.wire_ids(settings_.base_id);
  for (std::uint32_t& id : ids) id |= protocol_.extended ? extended_id_flag : 0;
  return ids;
}

std::vector<CanFrame> DescribedSensor::command_frames(const SensorCommand& command) const {
  std::vector<std::uint8_t> data = command.data;
  if (command.value) {
    put_number(data, *command.value, static_cast<std::uint64_t>(std::llround(command.divides_Hz / protocol_.rate_Hz)));
  }
  if (command.sum16) {
    unsigned sum = 0;
    for (const std::uint8_t byte : data) sum += byte;
    data.push_back(static_cast<std::uint8_t>(sum >> 8));
    data.push_back(static_cast<std::uint8_t>(sum));
  }
  std::vector<CanFrame> frames;
  std::size_t at = 0;
  do {
    CanFrame frame;
    frame.id = protocol_.wire_id(command.id, settings_.base_id);
    frame.extended = protocol_.extended;
    frame.fd = protocol_.fd;
    frame.bit_rate_switch = protocol_.bit_rate_switch;
    // Above 8 bytes CAN FD allows only certain lengths, so data are sent in frames of at most 8 bytes.
    const std::size_t length = std::min<std::size_t>(data.size() - at, 8);
    frame.length = static_cast<std::uint8_t>(length);
    std::copy_n(data.begin() + static_cast<std::ptrdiff_t>(at), length, frame.data.begin());
    frames.push_back(frame);
    at += length;
  } while (at < data.size());
  return frames;
}

void DescribedSensor::send_commands(CanNetwork& network, std::size_t bus, const FrameHandler& other) {
  const FrameHandler handler = [&](std::size_t from, const TimedFrame& received) {
    const bool ours = from == bus && on_frame(received.frame, received.time_ns);
    if (!ours && other) other(from, received);
  };
  for (const auto* command : {&protocol_.stop, &protocol_.clear_bias, &protocol_.rate, &protocol_.start}) {
    if (!*command) continue;
    fresh_ = counted_ = false;  // samples from before the command don't show its effect
    for (const CanFrame& frame : command_frames(**command)) {
      const SendResult result = network.bus(bus).send(frame);
      if (result == SendResult::sent || result == SendResult::queue_full) continue;
      throw SetupError({.bus = settings_.bus_name,
                        .message = "force sensor (" + name_ + "): its commands can't be sent",
                        .found = result == SendResult::bus_off ? "bus-off"
                                 : result == SendResult::down  ? "an interface that is down"
                                                               : "a bus that doesn't carry such frames",
                        .expected = "a bus that is up" + std::string(protocol_.fd ? " and carries CAN FD" : "")});
    }
    const std::int64_t until_ns = network.now_ns() + settings_.pause_ns;
    pump_frames(network, until_ns, handler, [&](std::int64_t) { return until_ns; });
  }
}

bool DescribedSensor::await_sample(CanNetwork& network, std::size_t bus, const FrameHandler& other) {
  const FrameHandler handler = [&](std::size_t from, const TimedFrame& received) {
    const bool ours = from == bus && on_frame(received.frame, received.time_ns);
    if (!ours && other) other(from, received);
  };
  CanFrame request;
  const std::int64_t now_ns = network.now_ns(), deadline_ns = now_ns + settings_.answer_timeout_ns;
  if (!streams_ && poll(now_ns, request)) (void)network.bus(bus).send(request);
  pump_frames(network, deadline_ns, handler, [&](std::int64_t) { return fresh_ ? pump_done : deadline_ns; });
  return fresh_;
}

void DescribedSensor::start(CanNetwork& network, std::size_t bus, const FrameHandler& other) {
  bool answered = false;
  for (int attempt = 0; attempt < settings_.attempts && !answered; ++attempt) {
    send_commands(network, bus, other);
    answered = await_sample(network, bus, other);
  }
  if (!answered) refuse_start();
  // Samples that the sensor streams while other devices are brought up don't count as lost.
  counted_ = false;
  counts_before_ = counts_;
  if (latest_.healthy) return;
  throw SetupError(
      {.bus = settings_.bus_name,
       .message = "force sensor (" + name_ + "), status",
       .found = describe_status(latest_.status),
       .expected = "no error",
       .advice = "switch the sensor's supply off and on; if the error stays, it needs the maker's service"});
}

void DescribedSensor::refuse_start() const {
  std::string found = "no answer";
  std::string advice = "is it powered, are its identifiers those of " + file_ +
                       ", and do bitrate, wiring and both terminations (120 "
                       "ohm) fit?";
  if (counts_.bad_checksums > 0) {
    found = std::to_string(counts_.bad_checksums) + " samples, all with a wrong checksum";
    advice = "is it the sensor of " + file_ + "?";
  } else if (counts_.wrong_lengths > 0) {
    found = std::to_string(counts_.wrong_lengths) + " frames of a wrong length";
    advice = "is it the sensor of " + file_ + ", or does another device use its identifiers?";
  } else if (counts_.incomplete > 0 || counts_.dropped > 0) {
    found = "parts of samples, but no whole one";
    advice = "a frame of each is missing or out of order: does the bus carry this rate, and is " + file_ +
             " the right file?";
  }
  throw SetupError({.bus = settings_.bus_name,
                    .message = "force sensor (" + name_ + ")",
                    .found = found,
                    .expected = "a sample of " + std::to_string(slots_.size()) +
                                (slots_.size() == 1 ? " frame" : " frames") + " from identifier " +
                                hex_text(slots_.front().id, protocol_.extended ? 8 : 3) + " on",
                    .advice = advice});
}

std::string DescribedSensor::identity() const {
  return name_ + " (" + file_ + "), " +
         (streams_ ? "streams " + description::number_text(protocol_.rate_Hz) + " samples a second" : "polled");
}

std::string DescribedSensor::describe_losses() const {
  return losses_text({{counts_.wrong_lengths - counts_before_.wrong_lengths, "frames of a wrong length"},
                      {counts_.late - counts_before_.late, "samples late, taken a cycle later where no newer one came"},
                      {counts_.incomplete - counts_before_.incomplete, "samples incomplete"},
                      {counts_.bad_checksums - counts_before_.bad_checksums, "samples with a bad checksum"},
                      {counts_.repeated - counts_before_.repeated, "samples with an old counter"},
                      {counts_.lost - counts_before_.lost, "samples left out by the counter"},
                      {counts_.dropped - counts_before_.dropped, "frames late, repeated or out of order"}});
}

std::string DescribedSensor::describe_status(std::uint32_t status) const {
  if (!protocol_.status || status == 0) return "no error";
  std::string text = "status " + hex_text(status, (protocol_.status->number.bits + 3) / 4);
  const char* separator = ": ";
  for (const auto& [bit, name] : protocol_.status->bits_named) {
    if ((status >> bit & 1) == 0) continue;
    text += separator + name;
    separator = ", ";
  }
  return text;
}

}  // namespace proxarm::fieldbus
