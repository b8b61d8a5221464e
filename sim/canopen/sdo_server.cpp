#include "sim/canopen/sdo_server.hpp"

#include <algorithm>

namespace proxarm::sim {

namespace {

constexpr std::uint8_t own_block_size = 127;  // number of segments in a sub-block that this server accepts, 1..127
// Maximum number of bytes that are collected before the dictionary checks them.
constexpr std::size_t longest_download = std::size_t{1} << 20;

std::uint32_t u32_at(const SdoServer::Message& m, std::size_t at) noexcept {
  return static_cast<std::uint32_t>(m[at]) | static_cast<std::uint32_t>(m[at + 1]) << 8 |
         static_cast<std::uint32_t>(m[at + 2]) << 16 | static_cast<std::uint32_t>(m[at + 3]) << 24;
}

void put_u32(SdoServer::Message& m, std::size_t at, std::uint32_t value) noexcept {
  for (std::size_t i = 0; i < 4; ++i) m[at + i] = static_cast<std::uint8_t>(value >> (8 * i));
}

}  // namespace

std::uint16_t sdo_block_crc(std::span<const std::uint8_t> bytes, std::uint16_t crc) noexcept {
  for (const std::uint8_t byte : bytes) {
    crc = static_cast<std::uint16_t>(crc ^ (byte << 8));
    for (int bit = 0; bit < 8; ++bit) {
      crc = static_cast<std::uint16_t>((crc & 0x8000) != 0 ? (crc << 1) ^ 0x1021 : crc << 1);
    }
  }
  return crc;
}

std::span<const SdoServer::Message> SdoServer::on_request(const Message& request) {
  answers_.clear();
  const std::uint8_t command = request[0];
  if (command == 0x80) {  // an abort, which may also come among segments, because no segment has the number 0
    on_abort();
    return answers_;
  }
  if (phase_ == Phase::block_download) {  // byte 0 can only be a sequence number here
    block_download_segment(request);
    return answers_;
  }
  switch (command >> 5) {  // bits 5 to 7 hold the client command specifier
    case 0:
      download_segment(request);
      break;
    case 1:
      begin_download(request);
      break;
    case 2:
      begin_upload(request);
      break;
    case 3:
      upload_segment(request);
      break;
    case 5:
      if ((command & 0x03) == 0) {
        begin_block_upload(request);
      } else {
        acknowledge_block_upload(request);
      }
      break;
    case 6:
      if ((command & 0x01) == 0) {
        begin_block_download(request);
      } else {
        end_block_download(request);
      }
      break;
    default:
      remember_object(request);
      abort(SdoAbort::command_specifier_not_valid);
      break;
  }
  return answers_;
}

void SdoServer::remember_object(const Message& request) noexcept {
  index_ = static_cast<std::uint16_t>(request[1] | request[2] << 8);
  subindex_ = request[3];
}

SdoServer::Message SdoServer::object_message(std::uint8_t command) const noexcept {
  return {command, static_cast<std::uint8_t>(index_), static_cast<std::uint8_t>(index_ >> 8), subindex_, 0, 0, 0, 0};
}

void SdoServer::abort(SdoAbort code) {
  Message message = object_message(0x80);
  put_u32(message, 4, static_cast<std::uint32_t>(code));
  answers_.clear();
  answer(message);
  phase_ = Phase::idle;
}

// Ends a download after all data were received: the dictionary checks and stores them.
void SdoServer::finish_download(const Message& message) {
  phase_ = Phase::idle;
  if (expected_ != 0 && data_.size() != expected_) return abort(SdoAbort::length_does_not_match);
  if (const SdoAbort code = dictionary_.write(index_, subindex_, data_); code != SdoAbort::none) return abort(code);
  answer(message);
}

// Begins a download. Request → answer:
//   001 x nn e s | index | subindex | data or size       →  60 | index | subindex
void SdoServer::begin_download(const Message& request) {
  remember_object(request);
  const bool expedited = (request[0] & 0x02) != 0, size_indicated = (request[0] & 0x01) != 0;
  const std::size_t unused = static_cast<std::size_t>(request[0] >> 2 & 0x03);
  if (expedited) {
    std::size_t length = 4 - unused;
    if (!size_indicated) {  // the object's own length is used
      const ObjectEntry* entry = dictionary_.find(index_, subindex_);
      const std::size_t own = entry == nullptr ? 0 : size_of(entry->type);
      length = own == 0 || own > 4 ? 4 : own;
    }
    data_.assign(request.begin() + 4, request.begin() + 4 + static_cast<std::ptrdiff_t>(length));
    expected_ = 0;
    return finish_download(object_message(0x60));
  }
  expected_ = size_indicated ? u32_at(request, 4) : 0;
  if (expected_ > longest_download) return abort(SdoAbort::out_of_memory);
  if (const SdoAbort code = dictionary_.can_write(index_, subindex_, expected_); code != SdoAbort::none) {
    return abort(code);
  }
  data_.clear();
  toggle_ = 0;
  phase_ = Phase::segmented_download;
  answer(object_message(0x60));
}

// Receives a segment of a download. Request → answer:
//   000 t nnn c | data                                    →  001 t 0000
void SdoServer::download_segment(const Message& request) {
  if (phase_ != Phase::segmented_download) return abort(SdoAbort::command_specifier_not_valid);
  const std::uint8_t toggle = request[0] >> 4 & 0x01;
  if (toggle != toggle_) return abort(SdoAbort::toggle_bit_not_alternated);
  const std::size_t length = 7 - static_cast<std::size_t>(request[0] >> 1 & 0x07);
  data_.insert(data_.end(), request.begin() + 1, request.begin() + 1 + static_cast<std::ptrdiff_t>(length));
  if (data_.size() > longest_download) return abort(SdoAbort::out_of_memory);
  if (expected_ != 0 && data_.size() > expected_) return abort(SdoAbort::length_too_high);
  const Message message{static_cast<std::uint8_t>(0x20 | toggle << 4), 0, 0, 0, 0, 0, 0, 0};
  toggle_ ^= 1;
  const bool last = (request[0] & 0x01) != 0;
  if (last) return finish_download(message);
  answer(message);
}

// Begins an upload. Request → expedited or segmented answer:
//   40 | index | subindex      →  010 0 nn 1 1 | index | subindex | data,  or  41 | index | subindex | size
void SdoServer::begin_upload(const Message& request) {
  remember_object(request);
  const ObjectEntry* entry = nullptr;
  if (const SdoAbort code = dictionary_.read(index_, subindex_, entry); code != SdoAbort::none) return abort(code);
  data_ = entry->value;
  initiate_upload_answer();
}

void SdoServer::initiate_upload_answer() {
  if (!data_.empty() && data_.size() <= 4) {
    Message message = object_message(static_cast<std::uint8_t>(0x43 | (4 - data_.size()) << 2));
    std::copy(data_.begin(), data_.end(), message.begin() + 4);
    phase_ = Phase::idle;
    return answer(message);
  }
  Message message = object_message(0x41);
  put_u32(message, 4, static_cast<std::uint32_t>(data_.size()));
  sent_ = 0;
  toggle_ = 0;
  phase_ = Phase::segmented_upload;
  answer(message);
}

// Sends a segment of an upload. Request → answer:
//   011 t 0000                                            →  000 t nnn c | data
void SdoServer::upload_segment(const Message& request) {
  if (phase_ != Phase::segmented_upload) return abort(SdoAbort::command_specifier_not_valid);
  const std::uint8_t toggle = request[0] >> 4 & 0x01;
  if (toggle != toggle_) return abort(SdoAbort::toggle_bit_not_alternated);
  const std::size_t length = std::min<std::size_t>(7, data_.size() - sent_);
  const bool last = sent_ + length == data_.size();
  Message message{};
  message[0] = static_cast<std::uint8_t>(toggle << 4 | (7 - length) << 1 | (last ? 1 : 0));
  std::copy_n(data_.begin() + static_cast<std::ptrdiff_t>(sent_), length, message.begin() + 1);
  sent_ += length;
  toggle_ ^= 1;
  if (last) phase_ = Phase::idle;
  answer(message);
}

// Begins a block download. Request → answer:
//   110 0 0 cc s 0 | index | subindex | size              →  101 0 0 sc 00 | index | subindex | segments per sub-block
void SdoServer::begin_block_download(const Message& request) {
  remember_object(request);
  with_crc_ = (request[0] & 0x04) != 0;
  expected_ = (request[0] & 0x02) != 0 ? u32_at(request, 4) : 0;
  if (expected_ > longest_download) return abort(SdoAbort::out_of_memory);
  if (const SdoAbort code = dictionary_.can_write(index_, subindex_, expected_); code != SdoAbort::none) {
    return abort(code);
  }
  data_.clear();
  sequence_ = 0;
  block_size_ = own_block_size;
  phase_ = Phase::block_download;
  Message message = object_message(0xA4);
  message[4] = block_size_;
  answer(message);
}

// Receives a segment of a block download. Request → answer at the end of a sub-block:
//   c sequence | data      →  A2 | last sequence number in order | segments per sub-block
// Segments out of order are ignored. The answer makes the client repeat them.
void SdoServer::block_download_segment(const Message& request) {
  const bool last = (request[0] & 0x80) != 0;
  const std::uint8_t sequence = request[0] & 0x7F;
  if (sequence == 0) return abort(SdoAbort::invalid_sequence_number);
  const bool in_order = sequence == sequence_ + 1;
  if (in_order) {
    data_.insert(data_.end(), request.begin() + 1, request.end());
    sequence_ = sequence;
    if (data_.size() > longest_download) return abort(SdoAbort::out_of_memory);
  }
  if (!last && sequence < block_size_) return;
  answer({0xA2, sequence_, block_size_, 0, 0, 0, 0, 0});
  if (last && in_order) phase_ = Phase::block_download_end;
  sequence_ = 0;
}

// Ends a block download. Request → answer:
//   110 nnn 0 1 | crc                                     →  A1
void SdoServer::end_block_download(const Message& request) {
  if (phase_ != Phase::block_download_end) return abort(SdoAbort::command_specifier_not_valid);
  const std::size_t unused = static_cast<std::size_t>(request[0] >> 2 & 0x07);
  data_.erase(data_.end() - static_cast<std::ptrdiff_t>(std::min(unused, data_.size())), data_.end());
  const auto crc = static_cast<std::uint16_t>(request[1] | request[2] << 8);
  if (with_crc_ && crc != sdo_block_crc(data_)) return abort(SdoAbort::crc_error);
  finish_download({0xA1, 0, 0, 0, 0, 0, 0, 0});
}

// Begins a block upload. Request → answer:
//   101 0 0 cc 00 | index | subindex | segments | pst     →  110 0 0 sc s 0 | index | subindex | size
// If the value isn't longer than the protocol switch threshold pst, it is uploaded without blocks.
void SdoServer::begin_block_upload(const Message& request) {
  remember_object(request);
  const ObjectEntry* entry = nullptr;
  if (const SdoAbort code = dictionary_.read(index_, subindex_, entry); code != SdoAbort::none) return abort(code);
  if (request[4] == 0 || request[4] > 127) return abort(SdoAbort::invalid_block_size);
  data_ = entry->value;
  if (request[5] != 0 && data_.size() <= request[5]) return initiate_upload_answer();
  with_crc_ = (request[0] & 0x04) != 0;
  block_size_ = request[4];
  sent_ = 0;
  sequence_ = 0;
  phase_ = Phase::block_upload_start;
  Message message = object_message(0xC6);
  put_u32(message, 4, static_cast<std::uint32_t>(data_.size()));
  answer(message);
}

// Continues a block upload after a request of the client:
//   A3                                             →  first sub-block
//   A2 | last sequence number in order | segments  →  next sub-block, or the end request: 110 nnn 0 1 | crc
//   A1                                             confirms the end request
void SdoServer::acknowledge_block_upload(const Message& request) {
  const std::uint8_t subcommand = request[0] & 0x03;
  if (subcommand == 3 && phase_ == Phase::block_upload_start) return send_sub_block();
  if (subcommand == 1 && phase_ == Phase::block_upload_end) {
    phase_ = Phase::idle;
    return;
  }
  if (subcommand != 2 || phase_ != Phase::block_upload) return abort(SdoAbort::command_specifier_not_valid);
  if (request[1] > sequence_) return abort(SdoAbort::invalid_sequence_number);
  if (request[2] == 0 || request[2] > 127) return abort(SdoAbort::invalid_block_size);
  const bool all_arrived = request[1] == sequence_;
  sent_ = std::min(sent_ + std::size_t{7} * request[1], data_.size());
  block_size_ = request[2];
  if (!all_arrived || sent_ < data_.size()) return send_sub_block();
  const std::size_t in_last = data_.empty() ? 0 : (data_.size() - 1) % 7 + 1;
  Message message{};
  message[0] = static_cast<std::uint8_t>(0xC1 | (7 - in_last) << 2);
  const std::uint16_t crc = with_crc_ ? sdo_block_crc(data_) : std::uint16_t{0};
  message[1] = static_cast<std::uint8_t>(crc);
  message[2] = static_cast<std::uint8_t>(crc >> 8);
  phase_ = Phase::block_upload_end;
  answer(message);
}

// Sends the segments of a sub-block (c sequence | data), beginning with the first byte that the client hasn't
// confirmed.
void SdoServer::send_sub_block() {
  std::size_t at = sent_;
  sequence_ = 0;
  bool last = false;
  while (!last && sequence_ < block_size_) {
    const std::size_t length = std::min<std::size_t>(7, data_.size() - at);
    last = at + length == data_.size();
    ++sequence_;
    Message message{};
    message[0] = static_cast<std::uint8_t>((last ? 0x80 : 0) | sequence_);
    std::copy_n(data_.begin() + static_cast<std::ptrdiff_t>(at), length, message.begin() + 1);
    at += length;
    answer(message);
  }
  phase_ = Phase::block_upload;
}

}  // namespace proxarm::sim
