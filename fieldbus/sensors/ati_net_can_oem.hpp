// ATI Net CAN OEM (NETCANOEM): a strain-gauge force/torque sensor with a request/answer protocol; numbers are
// big-endian.
//
// Wire: identifier = base id << 4 | op (base id 7 bits), classic frames. Requests of the master, answers of the sensor:
//   0  no data            →  op 0: status u16, SG0, SG2, SG4 (i16);  op 1: SG1, SG3, SG5 (i16)
//   2  row (0 fx .. 5 tz) →  op 2, 3, 4: two floats each, the six columns of that row of the calibration matrix
//   5  no data            →  op 5: serial number, 8 characters
//   7  no data            →  op 7: counts per force unit u32, counts per torque unit u32
//   8  no data            →  op 8: force unit, torque unit (codes)
//   F  no data            →  op F: firmware major, minor, build u16
//
//   wrench_S = unit · matrix · SG / counts per unit
//
// The sensor's own bias is never set, so its state doesn't matter.
//
// A sample is op 0 followed by op 1. The frames don't name the poll that they answer. So op 1 must follow its op 0
// after the same poll or, with a poll in between, within half a period: the next sample's op 1 comes a whole period
// later. Dropped and counted are an op 1 without its op 0, a second op 0, frames from before the last two polls, and
// wrong lengths. A sample that answers an older poll but is received after the last one is late: it is used until the
// last poll's answer comes.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "fieldbus/sensors/channel_watch.hpp"
#include "fieldbus/sensors/force_sensor.hpp"

namespace proxarm::fieldbus {

struct AtiNetCanOemSettings {
  std::string bus_name;          // for messages
  std::uint32_t base_id = 0x7F;  // maker's default; 0..7F
  std::int64_t answer_timeout_ns = 100'000'000;
  int attempts = 10;                 // per request, so the sensor has a second to start up
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

  // Values read at start, and counts of errors since.
  [[nodiscard]] const std::array<std::array<double, 6>, 6>& matrix() const noexcept { return matrix_; }
  [[nodiscard]] const std::array<std::uint32_t, 2>& counts_per_unit() const noexcept { return counts_per_unit_; }
  [[nodiscard]] const Gauges& gauges() const noexcept { return gauges_; }  // of the latest sample
  [[nodiscard]] std::uint64_t late_samples() const noexcept { return late_; }
  [[nodiscard]] std::uint64_t incomplete_samples() const noexcept { return incomplete_; }
  [[nodiscard]] std::uint64_t dropped_frames() const noexcept { return dropped_; }  // late, repeated or out of order
  [[nodiscard]] std::uint64_t wrong_lengths() const noexcept { return wrong_lengths_; }

 private:
  [[nodiscard]] std::uint32_t id(std::uint8_t op) const noexcept { return settings_.base_id << 4 | op; }
  // Repeats a request until its answer is complete (ops `op`, +1, …: `frames` frames of `bytes` bytes).
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
  std::array<std::array<double, 6>, 6> matrix_{};  // as received
  std::array<std::array<double, 6>, 6> scaled_{};  // SI unit · matrix / counts per unit
  std::array<std::uint32_t, 2> counts_per_unit_{};
  std::array<std::uint8_t, 2> unit_codes_{};
  std::string serial_;
  std::string firmware_;

  std::int64_t poll_ns_ = 0, older_poll_ns_ = 0;  // the last poll and the one before
  bool polled_ = false;
  bool half_ = false;  // op 0 received, waiting for op 1
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
