// SDO client (CiA 301, 7.2.4): reads and writes a node's objects, one transfer at a time.
//
// Wire: request 600 + node, answer 580 + node, eight bytes each, numbers little-endian. Byte 0 holds the command (hex).
// In the table, → separates request and answer, n counts unused bytes, t is the toggle bit, c marks the last segment:
//   upload           40 → 4x expedited (n in bits 2–3), or 41 segmented with size
//     each segment   60|t<<4 → t|n|c
//   download         2x expedited, or 21 segmented with size → 60
//     each segment   t<<4|n<<1|c → 20|t<<4
//   block download   C6 → A4 blksize
//     each block     7-byte segments numbered 1..blksize (bit 7: last segment) → A2 ackseq blksize
//     end            C1|n<<2 crc → A1
//   block upload     A4 blksize → C6 size
//     each block     A3 → segments; A2 ackseq blksize → further segments
//     end            C1|n<<2 crc (from the server) → A1
//   abort            80, object, code (from either side, at any time)
//
// SdoClient is a state machine that never blocks. Its caller passes it frames and the time; finished() reports whether
// the transfer has finished. Several clients can run side by side, but only one per node, because a node has one SDO
// channel. Use it only before and after the cycle, because it allocates.
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
  idle,  // no transfer has been started yet
  running,
  done,               // the transfer succeeded; data() has the value read
  aborted_by_server,  // the server aborted the transfer; see abort_code()
  aborted_by_client,  // the server's answer broke the protocol; abort_code() was sent to the server
  timed_out,          // no answer came in time; abort 05040000 was sent to the server
  not_sent,           // the request wasn't sent: bus off or interface down
};

enum class SdoTransfer : std::uint8_t {
  automatic,  // expedited up to four bytes, segmented above
  block,      // block transfer, whatever the size
};

struct SdoClientConfig {
  std::int64_t timeout_ns = 200'000'000;    // how long to wait for each answer
  std::uint8_t block_size = 127;            // segments in a block upload, 1..127
  std::size_t max_upload_bytes = 1U << 20;  // if a server sends more bytes, the transfer is aborted (05040005)
  int max_block_repeats = 3;                // how often a block may be sent or requested again without progress
};

// Computes the CRC-16 of block transfers: x¹⁶ + x¹² + x⁵ + 1, initial value 0, not reflected. The string "123456789"
// gives 31C3.
[[nodiscard]] std::uint16_t sdo_crc(std::span<const std::uint8_t> bytes, std::uint16_t crc = 0) noexcept;

// Return requests of one frame, for callers such as the cycle that match requests and answers themselves. Precondition:
// `bytes` is 1 to 4.
[[nodiscard]] CanFrame expedited_download(std::uint8_t node, ObjectAddress object, std::uint8_t bytes,
                                          std::uint32_t value) noexcept;
[[nodiscard]] CanFrame upload_request(std::uint8_t node, ObjectAddress object) noexcept;
// True if an answer is about this object.
[[nodiscard]] bool names_object(const CanFrame& frame, ObjectAddress object) noexcept;

class SdoClient {
 public:
  SdoClient(CanBus& bus, std::uint8_t node, const SdoClientConfig& config = {});

  // Each function starts a new transfer. If another transfer is running, it is first aborted, at the server too.
  void start_upload(ObjectAddress object, std::int64_t now_ns, SdoTransfer transfer = SdoTransfer::automatic);
  void start_download(ObjectAddress object, std::span<const std::uint8_t> data, std::int64_t now_ns,
                      SdoTransfer transfer = SdoTransfer::automatic);

  // True if the frame is an SDO answer of this node. An answer that doesn't fit the running transfer is only counted
  // (stale_answers()).
  bool on_frame(const CanFrame& frame, std::int64_t now_ns);
  // Sends a frame again that the interface's full queue refused. Detects a missing answer.
  void poll(std::int64_t now_ns);

  [[nodiscard]] bool finished() const noexcept { return outcome_ != SdoOutcome::running; }
  [[nodiscard]] SdoOutcome outcome() const noexcept { return outcome_; }
  [[nodiscard]] std::uint32_t abort_code() const noexcept { return abort_code_; }
  [[nodiscard]] std::span<const std::uint8_t> data() const noexcept { return data_; }
  [[nodiscard]] ObjectAddress object() const noexcept { return object_; }
  [[nodiscard]] std::uint8_t node() const noexcept { return node_; }
  [[nodiscard]] std::uint64_t stale_answers() const noexcept { return stale_answers_; }
  // Returns the time at which poll() must be called at the latest while a transfer runs.
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
  std::vector<std::uint8_t> data_;  // bytes read so far, or bytes to be written
  std::int64_t now_ns_ = 0;
  std::int64_t deadline_ns_ = 0;
  std::uint64_t stale_answers_ = 0;
  CanFrame unsent_{};  // a frame that waits because the interface's queue was full
  bool has_unsent_ = false;

  bool toggle_ = false;
  std::size_t position_ = 0;  // bytes of a download sent so far
  std::size_t segment_bytes_ = 0;
  bool size_known_ = false;
  std::size_t expected_size_ = 0;

  bool crc_used_ = false;
  std::uint8_t block_size_ = 0;  // segments per block; in a download the server chooses the number
  std::uint8_t sequence_ = 0;    // number of the last segment sent (download) or accepted in order (upload)
  std::size_t block_start_ = 0;  // position_ at the start of the block
  bool last_segment_ = false;
  int repeats_ = 0;
};

}  // namespace proxarm::fieldbus
