// Interface of a six-axis force/torque sensor to the master's cycle, independent of the sensor's make.
//
//   sensor.start(network, bus);                   // identity, calibration; throws SetupError
//   each cycle:  if (sensor.poll(now, frame)) bus.send(frame);  ...  sensor.on_frame(frame, time);
//                if (sensor.fresh()) use sensor.latest().wrench_S;
//
// The wrench acts on the tool side of the sensor. It is in newtons and newton metres, in the sensor's frame S, about
// the origin of S. The caller subtracts the sensor's zero and the tool's weight.
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
  std::int64_t time_ns = 0;  // when the sample's last frame was on the wire
  std::uint32_t status = 0;  // the maker's status word; see describe_status()
  bool healthy = false;      // the status reports no error
  bool saturated = false;    // some channel is at the end of its range, so the wrench can't be trusted
  bool late = false;         // the sample answers the poll before the last one, so it is a cycle old
  std::uint64_t number = 0;  // number of the sample, counted from 1
  // How many samples in a row before this one had the same raw reading. A large number means a frozen sensor.
  std::uint32_t repeats = 0;

  // How often a single channel has repeated its reading while other channels changed (channel_watch.hpp).
  std::uint32_t channel_repeats = 0;

  void archive(StateArchive& state) noexcept {
    state(wrench_S, time_ns, status, healthy, saturated, late, number, repeats, channel_repeats);
  }
};

// Set in lists of identifiers to mark a 29-bit identifier, as CAN_EFF_FLAG does.
inline constexpr std::uint32_t extended_id_flag = 0x80000000U;

class ForceSensor {
 public:
  ForceSensor() = default;
  ForceSensor(const ForceSensor&) = delete;
  ForceSensor& operator=(const ForceSensor&) = delete;
  virtual ~ForceSensor() = default;

  // ---- before the cycle ----
  // Returns the identifiers that the kernel's filters must let pass.
  [[nodiscard]] virtual std::vector<std::uint32_t> wanted_ids() const = 0;
  // Returns all identifiers that the sensor sends and receives, to check that no other device uses them.
  [[nodiscard]] virtual std::vector<std::uint32_t> used_ids() const { return wanted_ids(); }
  // Reads and checks the sensor's identity and calibration, and starts the sensor. `other` gets the frames of other
  // devices. Throws SetupError.
  virtual void start(CanNetwork& network, std::size_t bus, const FrameHandler& other = {}) = 0;
  // Returns make, serial number and calibration as read at start, in one line for the log.
  [[nodiscard]] virtual std::string identity() const = 0;

  // Begins a cycle: samples received before no longer count as fresh. Returns true and the frame that requests the next
  // sample; false if the sensor streams. If a sample comes after its cycle has stopped waiting and before the next
  // poll, it is used in the next cycle, unless that cycle's own sample comes in time. Older samples are dropped.
  virtual bool poll(std::int64_t now_ns, CanFrame& frame) noexcept = 0;
  // True if the sensor sent the frame.
  virtual bool on_frame(const CanFrame& frame, std::int64_t time_ns) noexcept = 0;
  [[nodiscard]] virtual bool fresh() const noexcept = 0;  // a complete sample was received since the last poll
  // True if no newer sample can come in this cycle, so that waiting is of no use.
  [[nodiscard]] virtual bool answered() const noexcept { return fresh(); }
  [[nodiscard]] virtual const ForceSample& latest() const noexcept = 0;
  // Archives the values read at start and all state that changes in a cycle.
  virtual void archive(StateArchive& state) noexcept = 0;
  // Archives the input that this cycle got from other sources than CAN frames. When the archive is read, this input is
  // restored before the cycle.
  virtual void archive_input(StateArchive& /*state*/) noexcept {}

  // ---- as text, not for the cycle ----
  [[nodiscard]] virtual std::string describe_status(std::uint32_t status) const = 0;
  // Returns the errors in received frames since the start, such as "4 samples with a bad checksum"; empty if there were
  // no errors.
  [[nodiscard]] virtual std::string describe_losses() const { return {}; }
};

// A count of errors and its name. losses_text() returns the counts that aren't 0 as text, such as "12 frames late, 3
// samples incomplete".
struct LossCount {
  std::uint64_t count;
  const char* what;
};
[[nodiscard]] std::string losses_text(std::initializer_list<LossCount> losses);

}  // namespace proxarm::fieldbus
