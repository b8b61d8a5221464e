// A force sensor's description: its protocol, its range, and data for the simulated sensor.
//
// A file under models/sensors. A real ATI Net CAN OEM sends its matrix and counts at start; its file holds values with
// which the simulated sensor answers those requests. For any other CAN sensor the file holds everything
// (sensor_protocol.hpp).
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "models/description/sensor_protocol.hpp"

namespace proxarm::description {

class YamlNode;

// The simulated sensor. With gauges g (counts) and wrench w = (Fx, Fy, Fz in N, Tx, Ty, Tz in Nm):
//   w = matrix · (g − bias) / (counts_per_N, …, counts_per_Nm, …)
struct SensorSimulation {
  std::array<std::array<double, 6>, 6> matrix{};  // rows Fx Fy Fz Tx Ty Tz, columns gauges 0..5; single precision, as
                                                  // on the wire
  std::uint32_t counts_per_N = 1'000'000;
  std::uint32_t counts_per_Nm = 1'000'000;
  std::array<double, 6> bias_counts{};  // gauges without load
};

struct SensorDescription {
  std::filesystem::path file;
  std::string name;
  std::string protocol;                   // "ati_net_can_oem" or "described"
  std::array<double, 3> force_range_N{};  // ± per axis of S; readings beyond it aren't trusted
  std::array<double, 3> torque_range_Nm{};
  SensorSimulation simulation;              // ati_net_can_oem
  std::optional<SensorProtocol> described;  // described
};

// How far the zero of such a sensor may differ from the known one, N, if its cell doesn't state it
// (`sensor.zero_drift_N`): 1 % of its largest range, the drift of strain gauges while they warm up.
double zero_drift_N(const SensorDescription& sensor) noexcept;

// The simulated sensor's reading without load, N: matrix · bias / counts per unit. Zero for a sensor described by its
// frames.
std::array<double, 3> simulated_zero_S_N(const SensorDescription& sensor) noexcept;

// Applies the cell's choices, if any. Throws SetupError, with file, line and key.
SensorDescription load_sensor(const std::filesystem::path& file, const SensorChoices& choices = {});
// The same for a file that has already been read.
SensorDescription read_sensor(const YamlNode& root, const SensorChoices& choices = {});

}  // namespace proxarm::description
