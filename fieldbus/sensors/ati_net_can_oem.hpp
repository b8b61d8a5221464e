// ATI Net CAN OEM (NETCANOEM): a strain-gauge force/torque sensor with a request/answer protocol; numbers are
// big-endian.
//
// Wire: identifier = base id << 4 | op (base id 7 bits), classic frames. Left of the arrow stands the master's request,
// right of it the sensor's answers:
//   0  no data            →  op 0: status u16, SG0, SG2, SG4 (i16);  op 1: SG1, SG3, SG5 (i16)
//   2  row (0 fx .. 5 tz) →  op 2, 3, 4: two floats each, the six columns of that row of the calibration matrix
//   5  no data            →  op 5: serial number, 8 characters
//   7  no data            →  op 7: counts per force unit u32, counts per torque unit u32
//   8  no data            →  op 8: force unit, torque unit (codes)
//   F  no data            →  op F: firmware major, minor, build u16
//
//   wrench_S = unit · matrix · SG / counts per unit
//
// The sensor can subtract a bias itself, but proxarm never sets this bias, so its value in the sensor doesn't matter.
//
// A sample consists of op 0 and then op 1. The frames don't say which poll they answer. Op 1 belongs to the op 0 before
// it in two cases: if both came after the same poll, or if a poll came between them and they are at most half a period
// apart. The next sample's op 1 comes a whole period later, so it can't be mistaken.
//
// These frames are dropped and counted:
// - an op 1 without its op 0
// - an op 0 whose op 1 is missing
// - frames from before the last two polls
// - frames of wrong length
// A sample is late if it answers the poll before the last one but was received after the last one. A late sample is
// used until the answer to the last poll comes.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "fieldbus/sensors/channel_watch.hpp"
#include "fieldbus/sensors/force_sensor.hpp"

namespace proxarm::fieldbus {

struct AtiNetCanOemSettings {
  std::string bus_name;          // appears in messages
  std::uint32_t base_id = 0x7F;  // 0..7F; the default is the maker's
  std::int64_t answer_timeout_ns = 100'000'000;
  int attempts = 10;                 // attempts per request; the sensor has a second to start up
  std::int16_t rail_counts = 32767;  // a gauge at or beyond ± this value is saturated
};

class AtiNetCanOem final : public ForceSensor {
 public:
  using Gauges = std::array<std::int16_t, 6>;

  explicit AtiNetCanOem(AtiNetCanOemSettings settings);  // throws SetupError

  [[nodiscard]] std::vector<std::uint32_t> wanted_ids() const override;
  void start(CanNetwork& network, std::size_t bus, const FrameHandler& other = {}) override;
  [[nodiscard]] std::string identity() const override;

  bool poll(std::int64_t now_ns, CanFrame& frame) noexcept override;
  bool on_frame(const CanFrame& frame, std::int64_t time_ns) noexcept override;
  [[nodiscard]] bool fresh() const noexcept override { return fresh_; }
  [[nodiscard]] bool answered() const noexcept override { return fresh_ && !latest_.late; }
  [[nodiscard]] const ForceSample& latest() const noexcept override { return latest_; }
  [[nodiscard]] std::string describe_status(std::uint32_t status) const override;
  [[nodiscard]] std::string describe_losses() const override;
  void archive(StateArchive& state) noexcept override {
    state(scaled_, poll_ns_, older_poll_ns_, polled_, half_, half_ns_, half_status_, half_gauges_, gauges_, fresh_,
          latest_, late_, incomplete_, dropped_, wrong_lengths_, channels_);
  }

  // Values that were read at start, and counts of errors since the start.
  [[nodiscard]] const std::array<std::array<double, 6>, 6>& matrix() const noexcept { return matrix_; }
  [[nodiscard]] const std::array<std::uint32_t, 2>& counts_per_unit() const noexcept { return counts_per_unit_; }
  [[nodiscard]] const Gauges& gauges() const noexcept { return gauges_; }  // the gauges of the latest sample
  [[nodiscard]] std::uint64_t late_samples() const noexcept { return late_; }
  [[nodiscard]] std::uint64_t incomplete_samples() const noexcept { return incomplete_; }
  // Frames that were late, repeated or out of order.
  [[nodiscard]] std::uint64_t dropped_frames() const noexcept { return dropped_; }
  [[nodiscard]] std::uint64_t wrong_lengths() const noexcept { return wrong_lengths_; }

 private:
  [[nodiscard]] std::uint32_t id(std::uint8_t op) const noexcept { return settings_.base_id << 4 | op; }
  // Repeats a request until its answer is complete. The answer consists of `frames` frames of `bytes` bytes each, with
  // the ops `op`, `op` + 1, …
  std::vector<CanFrame> ask(CanNetwork& network, std::size_t bus, const FrameHandler& other, std::uint8_t op,
                            std::vector<std::uint8_t> data, std::uint8_t frames, std::uint8_t bytes, const char* what);
  void read_matrix(CanNetwork& network, std::size_t bus, const FrameHandler& other);
  void read_scale(CanNetwork& network, std::size_t bus, const FrameHandler& other);
  void check_first_sample(CanNetwork& network, std::size_t bus, const FrameHandler& other);
  [[noreturn]] void refuse(const std::string& what, const std::string& found, const std::string& expected,
                           const std::string& advice) const;
  [[nodiscard]] bool in_time(std::int64_t time_ns) const noexcept;
  [[nodiscard]] bool fits_half(std::int64_t time_ns) const noexcept;
  void drop_half() noexcept;
  void complete(std::int64_t time_ns) noexcept;

  AtiNetCanOemSettings settings_;
  std::array<std::array<double, 6>, 6> matrix_{};  // as received from the sensor
  std::array<std::array<double, 6>, 6> scaled_{};  // SI unit · matrix / counts per unit
  std::array<std::uint32_t, 2> counts_per_unit_{};
  std::array<std::uint8_t, 2> unit_codes_{};
  std::string serial_;
  std::string firmware_;

  // Times of the last poll and of the poll before.
  std::int64_t poll_ns_ = 0, older_poll_ns_ = 0;
  bool polled_ = false;
  bool half_ = false;  // op 0 of a sample was received, op 1 not yet
  std::int64_t half_ns_ = 0;
  std::uint16_t half_status_ = 0;
  Gauges half_gauges_{};
  Gauges gauges_{};
  bool fresh_ = false;
  ChannelWatch channels_;
  ForceSample latest_{};
  std::uint64_t late_ = 0;
  std::uint64_t incomplete_ = 0;
  std::uint64_t dropped_ = 0;
  std::uint64_t wrong_lengths_ = 0;
};

}  // namespace proxarm::fieldbus
