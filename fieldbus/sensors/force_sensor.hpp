// A six-axis force/torque sensor on a CAN bus, whatever its make, as the master's cycle sees it.
//
//   sensor.start(network, bus);                   // identity, calibration; throws SetupError
//   each cycle:  if (sensor.poll(now, frame)) bus.send(frame);  ...  sensor.on_frame(frame, time);
//                if (sensor.fresh()) use sensor.latest().wrench_S;
//
// Force is what acts on the sensor's tool side, in newtons and newton metres, in the sensor's own frame S and about its
// own origin. Its zero is as the sensor was made: what it reads without a load, and what hangs there (tool weight), are
// the caller's to take off.
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
  std::uint32_t status = 0;   // the maker's status word, see describe_status()
  bool healthy = false;       // the status reports no error
  bool saturated = false;     // some channel is at its rail, so the wrench is not to be believed
  bool late = false;          // on the wire before the last poll: it answers an older one, and is a cycle older
  std::uint64_t number = 0;   // counts the samples, from 1
  std::uint32_t repeats = 0;  // samples before this one with exactly the same raw reading: a frozen sensor

  std::uint32_t channel_repeats = 0;  // of one channel alone, while others went on (channel_watch.hpp)

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
  // All that it sends and is sent, for the check that nobody else does.
  [[nodiscard]] virtual std::vector<std::uint32_t> used_ids() const { return wanted_ids(); }
  // Reads and checks what the sensor says of itself, and starts it; throws SetupError. Frames of others go to `other`.
  virtual void start(CanNetwork& network, std::size_t bus, const FrameHandler& other = {}) = 0;
  // What was learned at start: make, serial number, calibration; one line for the log.
  [[nodiscard]] virtual std::string identity() const = 0;

  // ---- cycle: noexcept, no allocation ----
  // The frame that asks for the next sample; false where the sensor streams by itself. What was received before no
  // longer counts as fresh. A sample that comes between two polls and after its cycle had stopped waiting is taken in
  // the next cycle, unless that one's own comes in time; older ones are dropped.
  virtual bool poll(std::int64_t now_ns, CanFrame& frame) noexcept = 0;
  virtual bool on_frame(const CanFrame& frame, std::int64_t time_ns) noexcept = 0;  // true when it was the sensor's
  [[nodiscard]] virtual bool fresh() const noexcept = 0;  // a whole sample was taken since the last poll
  // Nothing newer can come in this cycle: there is no use in waiting.
  [[nodiscard]] virtual bool answered() const noexcept { return fresh(); }
  [[nodiscard]] virtual const ForceSample& latest() const noexcept = 0;
  // What was read at start, and all that changes in a cycle.
  virtual void archive(StateArchive& state) noexcept = 0;
  // What this cycle took that came by no frame of a CAN bus; reading gives it back before the cycle.
  virtual void archive_input(StateArchive& /*state*/) noexcept {}

  // ---- in words, not for the cycle ----
  [[nodiscard]] virtual std::string describe_status(std::uint32_t status) const = 0;
  // What has been wrong with what came since it was started: "4 samples with a bad checksum"; empty: nothing.
  [[nodiscard]] virtual std::string describe_losses() const { return {}; }
};

// "12 frames late, 3 samples incomplete": those of the counts that aren't 0.
struct LossCount {
  std::uint64_t count;
  const char* what;
};
[[nodiscard]] std::string losses_text(std::initializer_list<LossCount> losses);

}  // namespace proxarm::fieldbus
