// A force sensor's description: which protocol it speaks, its range, and what only a simulated one must know.
//
// A file under models/sensors. What a real ATI Net CAN OEM needs beyond that (matrix, counts) is read over CAN at
// start; the simulation's values stand in the file, so that the simulated sensor can answer those requests. What any
// other CAN sensor needs is all in its file (sensor_protocol.hpp).
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "models/description/sensor_protocol.hpp"

namespace proxarm::description {

class YamlNode;

// The sensor as the far end of the wire. With gauges g (counts) and wrench w = (Fx, Fy, Fz in N, Tx, Ty, Tz in Nm):
//   w = matrix · (g − bias) / (counts_per_N, …, counts_per_Nm, …)
struct SensorSimulation {
  std::array<std::array<double, 6>, 6> matrix{};  // rows Fx Fy Fz Tx Ty Tz, columns gauges 0..5; single precision
                                                  // values, since that is what goes over the wire
  std::uint32_t counts_per_N = 1'000'000;
  std::uint32_t counts_per_Nm = 1'000'000;
  std::array<double, 6> bias_counts{};  // gauges without any load
};

struct SensorDescription {
  std::filesystem::path file;
  std::string name;
  std::string protocol;                   // "ati_net_can_oem" or "described"
  std::array<double, 3> force_range_N{};  // ± per axis of S; beyond it a reading isn't to be trusted
  std::array<double, 3> torque_range_Nm{};
  SensorSimulation simulation;              // ati_net_can_oem
  std::optional<SensorProtocol> described;  // described
};

// By how much the zero of such a sensor may differ from the one that is known, in N, where its cell doesn't say
// (`sensor.zero_drift_N`): 1 % of its largest range, which is what strain gauges drift by while they warm up.
double zero_drift_N(const SensorDescription& sensor) noexcept;

// What the simulated sensor reads without any load, in N: matrix · bias / counts per unit. A sensor that is described
// by its frames reads none.
std::array<double, 3> simulated_zero_S_N(const SensorDescription& sensor) noexcept;

// With what a cell chooses, or as the sensor is delivered. Throws SetupError, with file, line and key.
SensorDescription load_sensor(const std::filesystem::path& file, const SensorChoices& choices = {});
// The same of a file that has been read already.
SensorDescription read_sensor(const YamlNode& root, const SensorChoices& choices = {});

}  // namespace proxarm::description
