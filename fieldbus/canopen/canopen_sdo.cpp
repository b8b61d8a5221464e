#include "fieldbus/canopen/canopen_sdo.hpp"

#include <algorithm>

#include "fieldbus/can/byte_order.hpp"

namespace proxarm::fieldbus {
namespace {

// Pause before a frame is sent again that a full queue refused. It lasts about two frames at 1 Mbit/s, so the queue has
// space again.
constexpr std::int64_t retry_ns = 200'000;

constexpr std::uint8_t command_of(const CanFrame& frame) noexcept { return frame.data[0] >> 5; }

CanFrame request_about(std::uint8_t node, ObjectAddress object, std::uint8_t command) noexcept {
  CanFrame frame;
  frame.id = SdoClient::request_id(node);
  frame.length = 8;
  frame.data[0] = command;
  write_u16_le(&frame.data[1], object.index);
  frame.data[3] = object.sub;
  return frame;
}

}  // namespace

CanFrame expedited_download(std::uint8_t node, ObjectAddress object, std::uint8_t bytes, std::uint32_t value) noexcept {
  CanFrame frame = request_about(node, object, static_cast<std::uint8_t>(0x23 | (4 - bytes) << 2));
  write_u32_le(&frame.data[4], value);
  return frame;
}

CanFrame upload_request(std::uint8_t node, ObjectAddress object) noexcept { return request_about(node, object, 0x40); }

bool names_object(const CanFrame& frame, ObjectAddress object) noexcept {
  return frame.length >= 4 && read_u16_le(&frame.data[1]) == object.index && frame.data[3] == object.sub;
}

SdoClient::SdoClient(CanBus& bus, std::uint8_t node, const SdoClientConfig& config)
    : bus_(bus), node_(node), config_(config) {
  config_.block_size = std::clamp<std::uint8_t>(config_.block_size, 1, 127);
}

// ---- transfers begin and end ----

void SdoClient::begin(Step step, ObjectAddress object, std::int64_t now_ns) {
  now_ns_ = now_ns;
  if (outcome_ == SdoOutcome::running) abort(sdo_abort::general_error);
  object_ = object;
  outcome_ = SdoOutcome::running;
  step_ = step;
  abort_code_ = 0;
  has_unsent_ = toggle_ = size_known_ = crc_used_ = last_segment_ = false;
  position_ = segment_bytes_ = expected_size_ = block_start_ = 0;
  block_size_ = sequence_ = 0;
  repeats_ = 0;
}

void SdoClient::start_upload(ObjectAddress object, std::int64_t now_ns, SdoTransfer transfer) {
  const bool block = transfer == SdoTransfer::block;
  begin(block ? Step::block_upload_initiate : Step::upload_initiate, object, now_ns);
  data_.clear();
  CanFrame frame = object_request(block ? 0xA4 : 0x40);
  if (block) frame.data[4] = block_size_ = config_.block_size;
  send(frame);
}

void SdoClient::start_download(ObjectAddress object, std::span<const std::uint8_t> data, std::int64_t now_ns,
                               SdoTransfer transfer) {
  const bool block = transfer == SdoTransfer::block;
  begin(block ? Step::block_download_initiate : Step::download_initiate, object, now_ns);
  data_.assign(data.begin(), data.end());
  if (!block && !data.empty() && data.size() <= 4) {
    CanFrame frame = object_request(static_cast<std::uint8_t>(0x23 | (4 - data.size()) << 2));
    std::copy(data.begin(), data.end(), frame.data.begin() + 4);
    position_ = data.size();
    send(frame);
    return;
  }
  CanFrame frame = object_request(block ? 0xC6 : 0x21);
  write_u32_le(&frame.data[4], static_cast<std::uint32_t>(data.size()));
  send(frame);
}

void SdoClient::finish(SdoOutcome outcome, std::uint32_t code) noexcept {
  outcome_ = outcome;
  abort_code_ = code;
  has_unsent_ = false;
}

void SdoClient::abort(std::uint32_t code, SdoOutcome outcome) {
  CanFrame frame = object_request(0x80);
  write_u32_le(&frame.data[4], code);
  (void)bus_.send(frame);  // if the abort can't be sent, the server times out
  finish(outcome, code);
}

void SdoClient::send(const CanFrame& frame) {
  switch (bus_.send(frame)) {
    case SendResult::sent:
      deadline_ns_ = now_ns_ + config_.timeout_ns;
      return;
    case SendResult::queue_full:
      if (!has_unsent_) deadline_ns_ = now_ns_ + config_.timeout_ns;
      unsent_ = frame;
      has_unsent_ = true;
      return;
    case SendResult::bus_off:
    case SendResult::down:
    case SendResult::refused:
      finish(SdoOutcome::not_sent);
      return;
  }
}

CanFrame SdoClient::request(std::uint8_t command) const noexcept {
  CanFrame frame;
  frame.id = request_id(node_);
  frame.length = 8;
  frame.data[0] = command;
  return frame;
}

CanFrame SdoClient::object_request(std::uint8_t command) const noexcept {
  return request_about(node_, object_, command);
}

std::int64_t SdoClient::wake_ns(std::int64_t now_ns) const noexcept {
  return has_unsent_ ? std::min(deadline_ns_, now_ns + retry_ns) : deadline_ns_;
}

void SdoClient::poll(std::int64_t now_ns) {
  if (finished()) return;
  now_ns_ = now_ns;
  if (has_unsent_) {
    has_unsent_ = false;
    const std::int64_t deadline_ns = deadline_ns_;
    send(unsent_);
    if (has_unsent_) deadline_ns_ = deadline_ns;
    if (!finished() && !has_unsent_ && step_ == Step::block_download_segments) send_block_segments();
    if (finished()) return;
  }
  if (now_ns < deadline_ns_) return;
  // The last segment of a block may be lost. Acknowledging the received segments makes the server send the rest again.
  if (step_ == Step::block_upload_segments && repeats_ < config_.max_block_repeats) {
    ++repeats_;
    acknowledge_block();
    return;
  }
  abort(sdo_abort::timed_out, SdoOutcome::timed_out);
}

// ---- answers ----

bool SdoClient::on_frame(const CanFrame& frame, std::int64_t now_ns) {
  if (frame.id != answer_id(node_) || frame.extended || frame.remote || frame.error) return false;
  if (finished() || frame.length < 1) {
    ++stale_answers_;
    return true;
  }
  now_ns_ = now_ns;
  // In a block upload, a segment has no command: its first byte is a sequence number with bit 7 as the end mark. No
  // segment has the number 0, so 80h marks an abort.
  const bool is_segment = step_ == Step::block_upload_segments && frame.data[0] != 0x80;
  if (!is_segment && command_of(frame) == 4) {
    // An abort names the object of its transfer, or no object at all. An abort that names another object is a late
    // answer to an earlier transfer.
    const bool nameless = frame.length >= 4 && read_u16_le(&frame.data[1]) == 0;
    if (frame.length >= 8 && (names_object(frame, object_) || nameless)) {
      finish(SdoOutcome::aborted_by_server, read_u32_le(&frame.data[4]));
    } else {
      ++stale_answers_;
    }
    return true;
  }
  switch (step_) {
    case Step::upload_initiate:
      on_upload_initiate(frame);
      break;
    case Step::upload_segment:
      on_upload_segment(frame);
      break;
    case Step::download_initiate:
      on_download_initiate(frame);
      break;
    case Step::download_segment:
      on_download_segment(frame);
      break;
    case Step::block_download_initiate:
      on_block_download_initiate(frame);
      break;
    case Step::block_download_segments:
      on_block_download_ack(frame);
      break;
    case Step::block_download_end:
      on_block_download_end(frame);
      break;
    case Step::block_upload_initiate:
      on_block_upload_initiate(frame);
      break;
    case Step::block_upload_segments:
      on_block_upload_segment(frame);
      break;
    case Step::block_upload_end:
      on_block_upload_end(frame);
      break;
  }
  return true;
}

// ---- expedited and segmented upload ----

bool SdoClient::append(const std::uint8_t* bytes, std::size_t count) {
  if (data_.size() + count > config_.max_upload_bytes) {
    abort(sdo_abort::out_of_memory);
    return false;
  }
  data_.insert(data_.end(), bytes, bytes + count);
  return true;
}

void SdoClient::complete_upload() {
  if (size_known_ && data_.size() != expected_size_) {
    abort(sdo_abort::length_mismatch);
  } else {
    finish(SdoOutcome::done);
  }
}

void SdoClient::on_upload_initiate(const CanFrame& frame) {
  if (command_of(frame) != 2 || !names_object(frame, object_)) {
    ++stale_answers_;  // a late answer to an aborted transfer
    return;
  }
  const std::uint8_t command = frame.data[0];
  const bool expedited = (command & 2) != 0, size_given = (command & 1) != 0;
  if (expedited) {
    // Without a size, all four data bytes count; some nodes then send only as many bytes as the object has.
    const std::size_t count = size_given ? 4U - (command >> 2 & 3U) : std::min<std::size_t>(4, frame.length - 4U);
    if (frame.length < 4U + count) {
      abort(sdo_abort::length_mismatch);
    } else if (append(&frame.data[4], count)) {
      finish(SdoOutcome::done);
    }
    return;
  }
  if (size_given && frame.length >= 8) {
    size_known_ = true;
    expected_size_ = read_u32_le(&frame.data[4]);
    if (expected_size_ > config_.max_upload_bytes) {
      abort(sdo_abort::out_of_memory);
      return;
    }
  }
  step_ = Step::upload_segment;
  request_segment();
}

void SdoClient::request_segment() { send(request(toggle_ ? 0x70 : 0x60)); }

void SdoClient::on_upload_segment(const CanFrame& frame) {
  if (command_of(frame) != 0) {
    abort(sdo_abort::command_unknown);
    return;
  }
  const std::uint8_t command = frame.data[0];
  if (((command & 0x10) != 0) != toggle_) {
    abort(sdo_abort::toggle_not_alternated);
    return;
  }
  const std::size_t count = 7U - (command >> 1 & 7U);
  if (frame.length < 1U + count) {
    abort(sdo_abort::length_mismatch);
    return;
  }
  if (!append(&frame.data[1], count)) return;
  if ((command & 1) != 0) {
    complete_upload();
    return;
  }
  toggle_ = !toggle_;
  request_segment();
}

// ---- expedited and segmented download ----

void SdoClient::on_download_initiate(const CanFrame& frame) {
  if (command_of(frame) != 3 || !names_object(frame, object_)) {
    ++stale_answers_;
    return;
  }
  if (position_ == data_.size() && !data_.empty()) {
    finish(SdoOutcome::done);
    return;
  }
  step_ = Step::download_segment;
  send_segment();
}

void SdoClient::send_segment() {
  segment_bytes_ = std::min<std::size_t>(7, data_.size() - position_);
  last_segment_ = position_ + segment_bytes_ == data_.size();
  CanFrame frame =
      request(static_cast<std::uint8_t>((toggle_ ? 0x10 : 0x00) | (7 - segment_bytes_) << 1 | (last_segment_ ? 1 : 0)));
  std::copy_n(data_.begin() + static_cast<std::ptrdiff_t>(position_), segment_bytes_, frame.data.begin() + 1);
  send(frame);
}

void SdoClient::on_download_segment(const CanFrame& frame) {
  if (command_of(frame) != 1) {
    abort(sdo_abort::command_unknown);
    return;
  }
  if (((frame.data[0] & 0x10) != 0) != toggle_) {
    abort(sdo_abort::toggle_not_alternated);
    return;
  }
  position_ += segment_bytes_;
  if (last_segment_) {
    finish(SdoOutcome::done);
    return;
  }
  toggle_ = !toggle_;
  send_segment();
}

}  // namespace proxarm::fieldbus
