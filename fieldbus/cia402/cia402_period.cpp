#include "fieldbus/cia402/cia402_period.hpp"

#include <algorithm>

#include "fieldbus/can/byte_order.hpp"
#include "fieldbus/canopen/canopen_sdo.hpp"

namespace proxarm::fieldbus {
namespace {

CanFrame request(std::uint8_t node, const PeriodStep& step, bool write) noexcept {
  return write ? expedited_download(node, step.object, step.bytes, step.value) : upload_request(node, step.object);
}

}  // namespace

PeriodExchange::PeriodExchange(std::span<const DriveSlot> drives)
    : drives_(drives.begin(), drives.end()), nodes_(drives.size()) {}

void PeriodExchange::tell(std::int64_t from_ns, std::int64_t to_ns) noexcept {
  from_ns_ = from_ns;
  to_ns_ = to_ns;
  back_ = false;
  for (Node& node : nodes_) node.touched = false;
  restart();
}

void PeriodExchange::take_back() noexcept {
  back_ = true;
  restart();
}

void PeriodExchange::restart() noexcept {
  failed_ = false;
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    nodes_[i] = {.wanted = !back_ || nodes_[i].touched, .touched = nodes_[i].touched, .read_next = back_};
    skip_unchanged(i);
  }
}

bool PeriodExchange::done() const noexcept {
  return !failed_ && std::none_of(nodes_.begin(), nodes_.end(), [](const Node& node) { return node.wanted; });
}

// Returns the step that the drive is to execute now. When the old period is restored, the steps come in the opposite
// order, so that a drive in which only half of 60C2h was changed passes through no further interim period.
PeriodStep PeriodExchange::step_of(std::size_t drive) const noexcept {
  const PeriodSteps steps = drives_[drive].drive->period_steps(from_ns_, to_ns_);
  const std::size_t i = std::min<std::size_t>(nodes_[drive].step, steps.size() - 1);
  if (!back_) return steps[i];
  PeriodStep step = steps[steps.size() - 1 - i];
  step.value = step.old_value;
  return step;
}

bool PeriodExchange::next_request(std::int64_t now_ns, std::size_t& bus, CanFrame& frame) noexcept {
  if (failed_) return false;
  const auto busy = [this](std::size_t on_bus) {
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      if (drives_[i].bus == on_bus && nodes_[i].waiting != Waiting::nothing) return true;
    }
    return false;
  };
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    Node& node = nodes_[i];
    if (!node.wanted || busy(drives_[i].bus)) continue;
    frame = request(drives_[i].drive->node(), step_of(i), !node.read_next);
    bus = drives_[i].bus;
    node.waiting = node.read_next ? Waiting::read : Waiting::write;
    node.touched = true;
    node.deadline_ns = now_ns + drives_[i].drive->settings().sdo.client.timeout_ns;
    return true;
  }
  return false;
}

// Skips objects whose value is the same in both periods.
void PeriodExchange::skip_unchanged(std::size_t drive) noexcept {
  Node& node = nodes_[drive];
  for (; node.step < PeriodSteps().size(); ++node.step) {
    const PeriodSteps steps = drives_[drive].drive->period_steps(from_ns_, to_ns_);
    const PeriodStep& step = steps[back_ ? steps.size() - 1 - node.step : node.step];
    if (step.value != step.old_value) return;
  }
  node.wanted = false;
}

void PeriodExchange::advance(std::size_t drive) noexcept {
  Node& node = nodes_[drive];
  node.attempt = 0;
  node.written = false;
  node.read_next = back_;
  ++node.step;
  skip_unchanged(drive);
}

void PeriodExchange::fail(std::size_t drive, std::uint32_t code) noexcept {
  const ObjectAddress object = step_of(drive).object;
  refusal_ = {static_cast<std::int32_t>(drive), object.index, object.sub, code};
  failed_ = true;
}

bool PeriodExchange::on_frame(std::size_t bus, const CanFrame& frame) noexcept {
  if (frame.extended || frame.remote || frame.error) return false;
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    if (drives_[i].bus != bus || frame.id != SdoClient::answer_id(drives_[i].drive->node())) continue;
    if (!failed_ && nodes_[i].waiting != Waiting::nothing && frame.length == 8) on_answer(i, frame);
    return true;
  }
  return false;
}

// Handles the answer to the drive's current request. An answer that doesn't match the request is late and is ignored.
void PeriodExchange::on_answer(std::size_t drive, const CanFrame& frame) noexcept {
  Node& node = nodes_[drive];
  const PeriodStep step = step_of(drive);
  if (!names_object(frame, step.object)) return;
  const unsigned command = frame.data[0] >> 5;
  if (command == 4) {
    node.waiting = Waiting::nothing;
    const std::uint32_t code = read_u32_le(&frame.data[4]);
    const bool missing = code == sdo_abort::object_missing || code == sdo_abort::sub_index_missing;
    if (missing && step.is_optional) return advance(drive);
    return fail(drive, code);
  }
  if (command == 3 && node.waiting == Waiting::write) {
    node.waiting = Waiting::nothing;
    node.attempt = 0;
    node.written = node.read_next = true;
  } else if (command == 2 && node.waiting == Waiting::read) {
    node.waiting = Waiting::nothing;
    on_value(drive, frame);
  }
}

void PeriodExchange::on_value(std::size_t drive, const CanFrame& frame) noexcept {
  const PeriodStep step = step_of(drive);
  const std::uint32_t mask = step.bytes >= 4 ? 0xFFFFFFFFU : (1U << 8 * step.bytes) - 1U;
  const bool expedited = (frame.data[0] & 0x02) != 0;
  if (expedited && (read_u32_le(&frame.data[4]) & mask) == (step.value & mask)) return advance(drive);
  if (nodes_[drive].written) return fail(drive, 0);
  nodes_[drive].read_next = false;
}

void PeriodExchange::on_cycle(std::int64_t now_ns) noexcept {
  for (std::size_t i = 0; i < nodes_.size() && !failed_; ++i) {
    Node& node = nodes_[i];
    if (node.waiting == Waiting::nothing || now_ns < node.deadline_ns) continue;
    node.waiting = Waiting::nothing;
    node.written = false;  // the request may have been lost
    node.read_next = back_;
    if (++node.attempt >= attempts) fail(i, sdo_abort::timed_out);
  }
}

void PeriodExchange::archive(StateArchive& state) noexcept {
  state(from_ns_, to_ns_, back_, failed_, refusal_.drive, refusal_.index, refusal_.sub, refusal_.code);
  // A period that was read from a file may be invalid, so it is limited.
  constexpr std::int64_t longest_ns = 1'000'000'000;
  from_ns_ = std::clamp<std::int64_t>(from_ns_, 0, longest_ns);
  to_ns_ = std::clamp<std::int64_t>(to_ns_, 0, longest_ns);
  for (Node& node : nodes_) {
    state(node.wanted, node.touched, node.waiting, node.written, node.read_next, node.step, node.attempt,
          node.deadline_ns);
  }
}

}  // namespace proxarm::fieldbus
