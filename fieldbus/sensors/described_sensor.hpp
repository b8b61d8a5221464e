// A force/torque sensor known only by its description file (models/description/sensor_protocol.hpp). The file is
// converted to tables once. The cycle doesn't search or allocate, and accepts any bytes.
//
// A sample is complete when all its frames have come in order, within `together_s` of the first frame, with a right
// checksum and an increased counter. Parts of two samples are never mixed. If the protocol has neither counter nor
// checksum, the sample after an incomplete one is dropped too, because the order of its frames isn't certain.
//
// Frames of a polled sensor must come after one of the last two polls. A sample that answers the older poll is late.
// After a sample that isn't late, all frames until the next poll are dropped.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "fieldbus/sensors/channel_watch.hpp"
#include "fieldbus/sensors/force_sensor.hpp"
#include "models/description/sensor.hpp"

namespace proxarm::fieldbus {

struct DescribedSensorSettings {
  std::string bus_name;  // appears in messages
  std::uint32_t base_id = 0;
  std::int64_t answer_timeout_ns = 100'000'000;
  int attempts = 10;                  // attempts at start, so a booting sensor has a second
  std::int64_t pause_ns = 2'000'000;  // pause after each command
  // For streaming sensors: a frame is dropped if it was on the wire longer than this before the last call of poll().
  std::int64_t oldest_sample_ns = 20'000'000;
};

// Errors since the start. Each member counts frames unless its comment says samples.
struct DescribedSensorCounts {
  std::uint64_t wrong_lengths = 0;
  std::uint64_t dropped = 0;        // frames that were repeated, out of order, late, or sent before the poll
  std::uint64_t late = 0;           // samples that answer the poll before the last one
  std::uint64_t incomplete = 0;     // samples with a missing frame, or with frames in uncertain order
  std::uint64_t bad_checksums = 0;  // samples with a wrong checksum
  std::uint64_t repeated = 0;       // samples whose counter didn't increase
  std::uint64_t lost = 0;           // samples that must be missing, because the counter skipped numbers
};

class DescribedSensor final : public ForceSensor {
 public:
  // Throws SetupError if the description doesn't allow the base id, or if an identifier is that of NMT or SYNC.
  DescribedSensor(const description::SensorDescription& sensor, DescribedSensorSettings settings);

  [[nodiscard]] std::vector<std::uint32_t> wanted_ids() const override;
  [[nodiscard]] std::vector<std::uint32_t> used_ids() const override;
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
    state(sample_, next_, begun_ns_, torn_, poll_ns_, older_poll_ns_, polled_, fresh_, counted_, last_count_, numbers_,
          watch_, values_, latest_, counts_);
    if (next_ >= slots_.size()) next_ = 0;
  }

  [[nodiscard]] const DescribedSensorCounts& counts() const noexcept { return counts_; }

 private:
  static constexpr std::size_t max_signals = description::max_sensor_signals;

  // A number in the sample, prepared for extraction.
  struct Slice {
    std::uint16_t byte = 0;
    std::uint8_t bytes = 0, shift = 0;
    bool big_endian = true, is_signed = false, real = false;
    std::uint64_t mask = 0, sign = 0;
  };
  struct Slot {  // one frame of the sample
    std::uint32_t id = 0;
    std::uint8_t bytes = 0, head_bytes = 0;
    std::uint16_t at = 0;  // offset of the frame's data in the sample
    bool own_head = false;
    std::array<std::uint8_t, 64> head{};
  };
  struct Channel {
    Slice slice;
    double scale = 1.0, offset = 0.0, lowest = 0.0, highest = 0.0;
    Wrench column{};  // column of the matrix from channel values to wrench
  };

  [[nodiscard]] static Slice slice_of(const description::NumberField& number) noexcept;
  [[nodiscard]] std::uint64_t bits_of(const Slice& slice) const noexcept;
  [[nodiscard]] double number_of(const Slice& slice) const noexcept;
  [[nodiscard]] bool fits(std::size_t slot, const CanFrame& frame) const noexcept;
  [[nodiscard]] bool repeats_last(const CanFrame& frame) const noexcept;
  [[nodiscard]] bool came_together(std::int64_t time_ns) const noexcept;
  [[nodiscard]] bool in_time(std::int64_t time_ns) const noexcept;
  void take(std::size_t slot, const CanFrame& frame, std::int64_t time_ns) noexcept;
  void refuse_frame(const CanFrame& frame) noexcept;
  void tear() noexcept;
  void complete(std::int64_t time_ns) noexcept;
  [[nodiscard]] bool checksum_is_right() const noexcept;
  [[nodiscard]] bool counter_moved() noexcept;
  void decode(std::int64_t time_ns) noexcept;

  [[nodiscard]] std::vector<CanFrame> command_frames(const description::SensorCommand& command) const;
  void send_commands(CanNetwork& network, std::size_t bus, const FrameHandler& other);
  [[nodiscard]] bool await_sample(CanNetwork& network, std::size_t bus, const FrameHandler& other);
  [[noreturn]] void refuse_start() const;

  // Constant after the set-up.
  description::SensorProtocol protocol_;
  std::string name_;
  std::string file_;
  DescribedSensorSettings settings_;
  std::vector<Slot> slots_;
  std::vector<Channel> channels_;
  Slice counter_{}, status_{}, checksum_{};
  Wrench range_{};
  bool identity_matrix_ = true;
  bool order_is_certain_ = false;
  bool streams_ = true;
  std::int64_t together_ns_ = 0;
  CanFrame poll_frame_{};

  // Changed by the cycle.
  // Bytes of the sample being received. The array has 8 more bytes, because a slice may be read past the end.
  std::array<std::uint8_t, description::max_sample_bytes + 8> sample_{};
  // Slot of the next expected frame; 0: the first frame of a sample.
  std::size_t next_ = 0;
  std::int64_t begun_ns_ = 0;
  bool torn_ = false;  // the order of the next sample's frames isn't certain
  // Times of the last poll and of the poll before.
  std::int64_t poll_ns_ = 0, older_poll_ns_ = 0;
  bool polled_ = false;
  bool fresh_ = false;
  bool counted_ = false;  // a sample with a counter has been received
  std::uint64_t last_count_ = 0;
  ChannelWatch watch_;
  std::array<double, max_signals> numbers_{}, values_{};
  ForceSample latest_{};
  DescribedSensorCounts counts_{};
  DescribedSensorCounts counts_before_{};  // counts at the end of start(); errors before that aren't losses
};

}  // namespace proxarm::fieldbus
