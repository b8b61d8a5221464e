// Block transfers of the SDO client (CiA 301, 7.2.4.3.8 to 7.2.4.3.16).
#include <algorithm>

#include "fieldbus/can/byte_order.hpp"
#include "fieldbus/canopen/canopen_sdo.hpp"

namespace proxarm::fieldbus {
namespace {

constexpr std::size_t segment_size = 7;

constexpr std::uint8_t command_of(const CanFrame& frame) noexcept { return frame.data[0] >> 5; }

}  // namespace

std::uint16_t sdo_crc(std::span<const std::uint8_t> bytes, std::uint16_t crc) noexcept {
  for (const std::uint8_t byte : bytes) {
    crc = static_cast<std::uint16_t>(crc ^ byte << 8);
    for (int bit = 0; bit < 8; ++bit) {
      crc = static_cast<std::uint16_t>((crc & 0x8000) != 0 ? crc << 1 ^ 0x1021 : crc << 1);
    }
  }
  return crc;
}

// ---- download: the server reports how many segments a block may have, and how many it received in order ----

void SdoClient::on_block_download_initiate(const CanFrame& frame) {
  if (command_of(frame) != 5 || (frame.data[0] & 3) != 0 || frame.length < 5 || !names_object(frame, object_)) {
    ++stale_answers_;
    return;
  }
  crc_used_ = (frame.data[0] & 4) != 0;
  block_size_ = frame.data[4];
  if (block_size_ < 1 || block_size_ > 127) {
    abort(sdo_abort::invalid_block_size);
    return;
  }
  step_ = Step::block_download_segments;
  block_start_ = position_ = 0;
  sequence_ = 0;
  last_segment_ = false;
  if (data_.empty()) {
    send_block_end();
  } else {
    send_block_segments();
  }
}

// Sends segments until the block ends or the interface's queue is full. After a full queue, poll() continues.
void SdoClient::send_block_segments() {
  while (!finished() && !has_unsent_ && sequence_ < block_size_ && !last_segment_) {
    const std::size_t count = std::min(segment_size, data_.size() - position_);
    last_segment_ = position_ + count == data_.size();
    ++sequence_;
    CanFrame frame = request(static_cast<std::uint8_t>(sequence_ | (last_segment_ ? 0x80 : 0x00)));
    std::copy_n(data_.begin() + static_cast<std::ptrdiff_t>(position_), count, frame.data.begin() + 1);
    position_ += count;
    send(frame);
  }
}

void SdoClient::on_block_download_ack(const CanFrame& frame) {
  if (command_of(frame) != 5 || (frame.data[0] & 3) != 2 || frame.length < 3) {
    abort(sdo_abort::command_unknown);
    return;
  }
  const std::uint8_t acknowledged = frame.data[1];
  if (acknowledged > sequence_) {
    abort(sdo_abort::invalid_sequence_number);
    return;
  }
  if (frame.data[2] < 1 || frame.data[2] > 127) {
    abort(sdo_abort::invalid_block_size);
    return;
  }
  const bool all_taken = acknowledged == sequence_ && !has_unsent_;
  repeats_ = acknowledged > 0 ? 0 : repeats_ + 1;
  if (repeats_ > config_.max_block_repeats) {
    abort(sdo_abort::invalid_sequence_number);
    return;
  }
  if (all_taken && last_segment_) {
    send_block_end();
    return;
  }
  block_start_ = std::min(data_.size(), block_start_ + acknowledged * segment_size);
  position_ = block_start_;
  block_size_ = frame.data[2];
  sequence_ = 0;
  last_segment_ = has_unsent_ = false;
  send_block_segments();
}

void SdoClient::send_block_end() {
  step_ = Step::block_download_end;
  const std::size_t in_last = data_.empty() ? 0 : (data_.size() - 1) % segment_size + 1;
  CanFrame frame = request(static_cast<std::uint8_t>(0xC1 | (segment_size - in_last) << 2));
  if (crc_used_) write_u16_le(&frame.data[1], sdo_crc(data_));
  send(frame);
}

void SdoClient::on_block_download_end(const CanFrame& frame) {
  if (command_of(frame) != 5 || (frame.data[0] & 3) != 1) {
    ++stale_answers_;  // the acknowledgement of the last block came again
    return;
  }
  finish(SdoOutcome::done);
}

// ---- upload: the client reports how many segments a block may have, and how many it received in order ----

void SdoClient::on_block_upload_initiate(const CanFrame& frame) {
  if (command_of(frame) != 6 || (frame.data[0] & 1) != 0 || !names_object(frame, object_)) {
    ++stale_answers_;
    return;
  }
  crc_used_ = (frame.data[0] & 4) != 0;
  size_known_ = (frame.data[0] & 2) != 0 && frame.length >= 8;
  expected_size_ = size_known_ ? read_u32_le(&frame.data[4]) : 0;
  if (expected_size_ > config_.max_upload_bytes) {
    abort(sdo_abort::out_of_memory);
    return;
  }
  step_ = Step::block_upload_segments;
  sequence_ = 0;
  send(request(0xA3));
}

void SdoClient::on_block_upload_segment(const CanFrame& frame) {
  const std::uint8_t sequence = frame.data[0] & 0x7F;
  const bool last = (frame.data[0] & 0x80) != 0;
  if (sequence == 0 || sequence > block_size_) {
    abort(sdo_abort::invalid_sequence_number);
    return;
  }
  if (sequence == sequence_ + 1 && !last_segment_) {
    // Only the transfer's last segment may have fewer than seven bytes; the end frame says how many of them count.
    if (frame.length < 8 && !last) {
      abort(sdo_abort::length_mismatch);
      return;
    }
    if (!append(&frame.data[1], segment_size)) return;
    sequence_ = sequence;
    last_segment_ = last;
    repeats_ = 0;
  }
  deadline_ns_ = now_ns_ + config_.timeout_ns;
  // Segments after a lost segment are ignored. The acknowledgement at the end of the block reports the loss.
  if (last || sequence == block_size_) acknowledge_block();
}

void SdoClient::acknowledge_block() {
  CanFrame frame = request(0xA2);
  frame.data[1] = sequence_;
  frame.data[2] = block_size_ = config_.block_size;
  sequence_ = 0;
  if (last_segment_) step_ = Step::block_upload_end;
  send(frame);
}

void SdoClient::on_block_upload_end(const CanFrame& frame) {
  if (command_of(frame) != 6 || (frame.data[0] & 3) != 1 || frame.length < 3) {
    abort(sdo_abort::command_unknown);
    return;
  }
  const std::size_t unused = frame.data[0] >> 2 & 7U;
  if (unused > data_.size()) {
    abort(sdo_abort::length_mismatch);
    return;
  }
  data_.resize(data_.size() - unused);
  if (crc_used_ && sdo_crc(data_) != read_u16_le(&frame.data[1])) {
    abort(sdo_abort::crc_error);
    return;
  }
  if (size_known_ && data_.size() != expected_size_) {
    abort(sdo_abort::length_mismatch);
    return;
  }
  (void)bus_.send(request(0xA1));
  finish(SdoOutcome::done);
}

}  // namespace proxarm::fieldbus
