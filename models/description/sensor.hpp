// Describes a force sensor: its protocol, its range, and data for the simulated sensor.
//
// The file is in models/sensors. A real ATI Net CAN OEM sends its matrix and its counts per unit at the start. So the
// file of this sensor contains the values with which the simulated sensor answers the requests for them. For any other
// CAN sensor the file contains everything (sensor_protocol.hpp).
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "models/description/sensor_protocol.hpp"

namespace proxarm::description {

class YamlNode;

// The simulated sensor. For gauges g (counts) and wrench w = (Fx, Fy, Fz in N, Tx, Ty, Tz in Nm):
//   w = matrix · (g − bias) / (counts_per_N, …, counts_per_Nm, …)
struct SensorSimulation {
  // Rows Fx Fy Fz Tx Ty Tz, columns gauges 0..5. The values have single precision, as on the wire.
  std::array<std::array<double, 6>, 6> matrix{};
  std::uint32_t counts_per_N = 1'000'000;
  std::uint32_t counts_per_Nm = 1'000'000;
  std::array<double, 6> bias_counts{};  // the gauges' counts without load
};

struct SensorDescription {
  std::filesystem::path file;
  std::string name;
  std::string protocol;                   // "ati_net_can_oem" or "described"
  std::array<double, 3> force_range_N{};  // ± per axis of S; readings outside this range aren't trusted
  std::array<double, 3> torque_range_Nm{};
  SensorSimulation simulation;              // only for ati_net_can_oem
  std::optional<SensorProtocol> described;  // only for "described"
};

// Returns how far the zero of such a sensor may differ from its known zero (N) if the cell doesn't state
// `sensor.zero_drift_N`. This is 1 % of the largest range, which is the drift of strain gauges while they warm up.
double zero_drift_N(const SensorDescription& sensor) noexcept;

// Returns the simulated sensor's reading without load, N: matrix · bias / counts per unit. It is zero for a sensor with
// protocol "described".
std::array<double, 3> simulated_zero_S_N(const SensorDescription& sensor) noexcept;

// Reads a sensor's file and applies the cell's choices, if any. Throws SetupError, with file, line and key.
SensorDescription load_sensor(const std::filesystem::path& file, const SensorChoices& choices = {});
// Does what load_sensor() does, for a file that has already been read.
SensorDescription read_sensor(const YamlNode& root, const SensorChoices& choices = {});

}  // namespace proxarm::description
