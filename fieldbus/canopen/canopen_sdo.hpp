// SDO client (CiA 301, 7.2.4): reads and writes a node's objects, one transfer at a time.
//
// Wire: request 600 + node, answer 580 + node, eight bytes each, numbers little-endian. Byte 0 holds the command:
//   upload   initiate 40 → 4x expedited (n = bytes unused, bits 2–3), 41 segmented with size; segment 60|t<<4 → t|n|c
//   download initiate 2x expedited, 21 segmented with size → 60; segment t<<4|n<<1|c → 20|t<<4
//   block download C6 → A4 blksize; 7-byte segments numbered 1..blksize (bit 7: last) → A2 ackseq blksize;
//                  C1|n<<2 crc → A1
//   block upload   A4 blksize → C6 size; A3 → segments; A2 ackseq blksize; C1|n<<2 crc → A1
//   abort          80, object, code (either side, at any time)
//
// SdoClient is a state machine that never blocks: it gets frames and the time, and reports whether the transfer has
// finished. Several can run side by side, one per node, as a node has one SDO channel. For use before and after the
// cycle, never in it: it allocates.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "fieldbus/can/can_frame.hpp"
#include "fieldbus/can/can_network.hpp"
#include "fieldbus/canopen/canopen_object.hpp"
#include "fieldbus/canopen/canopen_sdo_abort.hpp"

namespace proxarm::fieldbus {

enum class SdoOutcome : std::uint8_t {
  idle,  // nothing requested yet
  running,
  done,               // data() has the value read
  aborted_by_server,  // see abort_code()
  aborted_by_client,  // the answer broke the protocol; abort_code() was sent to the server
  timed_out,          // no answer in time; abort 05040000 was sent to the server
  not_sent,           // bus off or interface down
};

enum class SdoTransfer : std::uint8_t {
  automatic,  // expedited up to four bytes, else segmented
  block,      // block transfer for any size
};

struct SdoClientConfig {
  std::int64_t timeout_ns = 200'000'000;    // for each answer
  std::uint8_t block_size = 127;            // segments in a block upload, 1..127
  std::size_t max_upload_bytes = 1U << 20;  // a server that sends more is aborted (05040005)
  int max_block_repeats = 3;                // sub-blocks sent or requested again without progress
};

// CRC-16 of block transfers: x¹⁶ + x¹² + x⁵ + 1, start 0, not reflected. The string "123456789" gives 31C3.
[[nodiscard]] std::uint16_t sdo_crc(std::span<const std::uint8_t> bytes, std::uint16_t crc = 0) noexcept;

// Requests of one frame, for callers that match the answers themselves, as the cycle does. `bytes`: 1 to 4.
[[nodiscard]] CanFrame expedited_download(std::uint8_t node, ObjectAddress object, std::uint8_t bytes,
                                          std::uint32_t value) noexcept;
[[nodiscard]] CanFrame upload_request(std::uint8_t node, ObjectAddress object) noexcept;
// True if an answer is about this object.
[[nodiscard]] bool names_object(const CanFrame& frame, ObjectAddress object) noexcept;

class SdoClient {
 public:
  SdoClient(CanBus& bus, std::uint8_t node, const SdoClientConfig& config = {});

  // Each aborts a running transfer (also at the server) and starts a new one.
  void start_upload(ObjectAddress object, std::int64_t now_ns, SdoTransfer transfer = SdoTransfer::automatic);
  void start_download(ObjectAddress object, std::span<const std::uint8_t> data, std::int64_t now_ns,
                      SdoTransfer transfer = SdoTransfer::automatic);

  // True if the frame is an SDO answer of this node. Stale answers are only counted.
  bool on_frame(const CanFrame& frame, std::int64_t now_ns);
  // Sends a frame that the interface's full queue refused, and detects a missing answer.
  void poll(std::int64_t now_ns);

  [[nodiscard]] bool finished() const noexcept { return outcome_ != SdoOutcome::running; }
  [[nodiscard]] SdoOutcome outcome() const noexcept { return outcome_; }
  [[nodiscard]] std::uint32_t abort_code() const noexcept { return abort_code_; }
  [[nodiscard]] std::span<const std::uint8_t> data() const noexcept { return data_; }
  [[nodiscard]] ObjectAddress object() const noexcept { return object_; }
  [[nodiscard]] std::uint8_t node() const noexcept { return node_; }
  [[nodiscard]] std::uint64_t stale_answers() const noexcept { return stale_answers_; }
  // Latest time for the next call of poll() while running.
  [[nodiscard]] std::int64_t wake_ns(std::int64_t now_ns) const noexcept;

  [[nodiscard]] static std::uint32_t request_id(std::uint8_t node) noexcept { return 0x600U + node; }
  [[nodiscard]] static std::uint32_t answer_id(std::uint8_t node) noexcept { return 0x580U + node; }

 private:
  enum class Step : std::uint8_t {
    upload_initiate,
    upload_segment,
    download_initiate,
    download_segment,
    block_download_initiate,
    block_download_segments,
    block_download_end,
    block_upload_initiate,
    block_upload_segments,
    block_upload_end,
  };

  void begin(Step step, ObjectAddress object, std::int64_t now_ns);
  void finish(SdoOutcome outcome, std::uint32_t code = 0) noexcept;
  void abort(std::uint32_t code, SdoOutcome outcome = SdoOutcome::aborted_by_client);
  void send(const CanFrame& frame);
  [[nodiscard]] CanFrame request(std::uint8_t command) const noexcept;
  [[nodiscard]] CanFrame object_request(std::uint8_t command) const noexcept;

  void on_upload_initiate(const CanFrame& frame);
  void on_upload_segment(const CanFrame& frame);
  void on_download_initiate(const CanFrame& frame);
  void on_download_segment(const CanFrame& frame);
  void on_block_download_initiate(const CanFrame& frame);
  void on_block_download_ack(const CanFrame& frame);
  void on_block_download_end(const CanFrame& frame);
  void on_block_upload_initiate(const CanFrame& frame);
  void on_block_upload_segment(const CanFrame& frame);
  void on_block_upload_end(const CanFrame& frame);

  void request_segment();
  void send_segment();
  void send_block_segments();
  void send_block_end();
  void acknowledge_block();
  bool append(const std::uint8_t* bytes, std::size_t count);
  void complete_upload();

  CanBus& bus_;
  std::uint8_t node_;
  SdoClientConfig config_;
  ObjectAddress object_{};
  SdoOutcome outcome_ = SdoOutcome::idle;
  Step step_ = Step::upload_initiate;
  std::uint32_t abort_code_ = 0;
  std::vector<std::uint8_t> data_;  // read so far, or to be written
  std::int64_t now_ns_ = 0;
  std::int64_t deadline_ns_ = 0;
  std::uint64_t stale_answers_ = 0;
  CanFrame unsent_{};  // waits because the interface's queue was full
  bool has_unsent_ = false;

  bool toggle_ = false;
  std::size_t position_ = 0;  // bytes of a download sent so far
  std::size_t segment_bytes_ = 0;
  bool size_known_ = false;
  std::size_t expected_size_ = 0;

  bool crc_used_ = false;
  std::uint8_t block_size_ = 0;  // segments per block, requested by the server
  std::uint8_t sequence_ = 0;    // last segment sent, or last one accepted in order
  std::size_t block_start_ = 0;  // position_ at the start of the block
  bool last_segment_ = false;
  int repeats_ = 0;
};

}  // namespace proxarm::fieldbus
