// The SDO server of a simulated CANopen device (CiA 301, 7.2.4): expedited, segmented and block transfers in both
// directions. The code was written from the standard and shares no code with the client in fieldbus, so each side tests
// the other.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "sim/canopen/object_dictionary.hpp"

namespace proxarm::sim {

// Returns the CRC of block transfers: x¹⁶ + x¹² + x⁵ + 1, start value 0, not reflected (CiA 301, 7.2.4.3.16).
[[nodiscard]] std::uint16_t sdo_block_crc(std::span<const std::uint8_t> bytes, std::uint16_t crc = 0) noexcept;

class SdoServer {
 public:
  using Message = std::array<std::uint8_t, 8>;

  explicit SdoServer(ObjectDictionary& dictionary) : dictionary_(dictionary) {}

  // Handles the eight bytes of a request, which may be any bytes. Returns the messages to be sent, in order: none, one,
  // or a complete sub-block of a block upload. The messages are valid until the next call. A request that begins a
  // transfer ends the transfer before.
  [[nodiscard]] std::span<const Message> on_request(const Message& request);

  // Resets the communication: ends a transfer in progress.
  void reset() noexcept { phase_ = Phase::idle; }

 private:
  enum class Phase : std::uint8_t {
    idle,
    segmented_download,
    segmented_upload,
    block_download,      // segments are being received
    block_download_end,  // all segments were received; the end request with the CRC is awaited
    block_upload_start,  // the initiate request was answered; the start request is awaited
    block_upload,        // a sub-block was sent; its acknowledgement is awaited
    block_upload_end,    // the end request was sent; its confirmation is awaited
  };

  void on_abort() noexcept { phase_ = Phase::idle; }
  void begin_download(const Message& request);
  void download_segment(const Message& request);
  void begin_upload(const Message& request);
  void upload_segment(const Message& request);
  void begin_block_download(const Message& request);
  void block_download_segment(const Message& request);
  void end_block_download(const Message& request);
  void begin_block_upload(const Message& request);
  void acknowledge_block_upload(const Message& request);
  void send_sub_block();
  void initiate_upload_answer();

  void finish_download(const Message& answer);
  void answer(const Message& message) { answers_.push_back(message); }
  void abort(SdoAbort code);
  void remember_object(const Message& request) noexcept;
  [[nodiscard]] Message object_message(std::uint8_t command) const noexcept;

  ObjectDictionary& dictionary_;
  std::vector<Message> answers_;

  Phase phase_ = Phase::idle;
  std::uint16_t index_ = 0;
  std::uint8_t subindex_ = 0;
  std::vector<std::uint8_t> data_;  // bytes received so far, or bytes to be sent
  std::size_t expected_ = 0;        // number of bytes that the client has announced; 0: not announced
  std::size_t sent_ = 0;            // number of bytes of data_ that the client has confirmed
  std::uint8_t toggle_ = 0;
  std::uint8_t block_size_ = 0;  // segments per sub-block
  std::uint8_t sequence_ = 0;    // number of the last segment received in order, or sent
  bool with_crc_ = false;
};

}  // namespace proxarm::sim
