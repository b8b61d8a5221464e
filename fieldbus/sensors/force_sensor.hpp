// Interface of a six-axis force/torque sensor to the master's cycle, independent of its make.
//
//   sensor.start(network, bus);                   // identity, calibration; throws SetupError
//   each cycle:  if (sensor.poll(now, frame)) bus.send(frame);  ...  sensor.on_frame(frame, time);
//                if (sensor.fresh()) use sensor.latest().wrench_S;
//
// The wrench acts on the sensor's tool side, in newtons and newton metres, in the sensor's frame S about its origin.
// The caller subtracts the sensor's zero and the tool's weight.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <string>
#include <vector>

#include "fieldbus/can/can_frame.hpp"
#include "fieldbus/can/can_network.hpp"
#include "fieldbus/can/frame_pump.hpp"
#include "models/base/state_archive.hpp"

namespace proxarm::fieldbus {

using Wrench = std::array<double, 6>;  // fx fy fz (N), tx ty tz (Nm)

struct ForceSample {
  Wrench wrench_S{};
  std::int64_t time_ns = 0;   // when its last frame was on the wire
  std::uint32_t status = 0;   // the maker's status word; see describe_status()
  bool healthy = false;       // the status reports no error
  bool saturated = false;     // some channel is at the end of its range; the wrench can't be trusted
  bool late = false;          // was on the wire before the last poll: answers an older one, and is a cycle old
  std::uint64_t number = 0;   // counts samples, from 1
  std::uint32_t repeats = 0;  // samples before this one with the same raw reading: many mean a frozen sensor

  std::uint32_t channel_repeats = 0;  // the same for a single channel while others change (channel_watch.hpp)

  void archive(StateArchive& state) noexcept {
    state(wrench_S, time_ns, status, healthy, saturated, late, number, repeats, channel_repeats);
  }
};

// Marks a 29-bit identifier in lists of identifiers, as CAN_EFF_FLAG does.
inline constexpr std::uint32_t extended_id_flag = 0x80000000U;

class ForceSensor {
 public:
  ForceSensor() = default;
  ForceSensor(const ForceSensor&) = delete;
  ForceSensor& operator=(const ForceSensor&) = delete;
  virtual ~ForceSensor() = default;

  // ---- before the cycle ----
  [[nodiscard]] virtual std::vector<std::uint32_t> wanted_ids() const = 0;  // for the kernel's filters
  // All identifiers that it sends and receives, to check that no other device uses them.
  [[nodiscard]] virtual std::vector<std::uint32_t> used_ids() const { return wanted_ids(); }
  // Reads and checks the sensor's identity and calibration, and starts it; throws SetupError. Frames of others go to
  // `other`.
  virtual void start(CanNetwork& network, std::size_t bus, const FrameHandler& other = {}) = 0;
  // Make, serial number and calibration, as read at start; one line for the log.
  [[nodiscard]] virtual std::string identity() const = 0;

  // ---- cycle: noexcept, no allocation ----
  // The frame that requests the next sample; false if the sensor streams. Samples received before are no longer fresh.
  // A sample that comes between two polls, after its cycle has stopped waiting, is used in the next cycle unless that
  // cycle's own sample comes in time. Older samples are dropped.
  virtual bool poll(std::int64_t now_ns, CanFrame& frame) noexcept = 0;
  // True if the frame was the sensor's.
  virtual bool on_frame(const CanFrame& frame, std::int64_t time_ns) noexcept = 0;
  [[nodiscard]] virtual bool fresh() const noexcept = 0;  // a whole sample was received since the last poll
  // True if no newer sample can come in this cycle, so that waiting is useless.
  [[nodiscard]] virtual bool answered() const noexcept { return fresh(); }
  [[nodiscard]] virtual const ForceSample& latest() const noexcept = 0;
  // The values read at start, and all state that changes in a cycle.
  virtual void archive(StateArchive& state) noexcept = 0;
  // Input of this cycle that didn't come by a CAN frame; reading restores it before the cycle.
  virtual void archive_input(StateArchive& /*state*/) noexcept {}

  // ---- in words, not for the cycle ----
  [[nodiscard]] virtual std::string describe_status(std::uint32_t status) const = 0;
  // Errors of received frames since the start: "4 samples with a bad checksum"; empty: none.
  [[nodiscard]] virtual std::string describe_losses() const { return {}; }
};

// The counts that aren't 0, as text: "12 frames late, 3 samples incomplete".
struct LossCount {
  std::uint64_t count;
  const char* what;
};
[[nodiscard]] std::string losses_text(std::initializer_list<LossCount> losses);

}  // namespace proxarm::fieldbus
