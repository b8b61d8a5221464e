// Contains a cell's choices for its sensor, in addition to the sensor's file: identifiers, numbers, divisors and ranges
// of this one sensor.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace proxarm::description {

// The value of one of the `settings` in the sensor's file (sensor_protocol.hpp).
struct SensorSettingChoice {
  std::string name{};
  std::int64_t value = 0;
  int line = 0;  // line in the cell's file

  bool operator==(const SensorSettingChoice&) const = default;
};

struct SensorChoices {
  std::filesystem::path file{};  // path of the cell's file, for error messages
  std::vector<SensorSettingChoice> settings{};
  std::optional<std::array<double, 3>> force_range_N{}, torque_range_Nm{};  // replace the ranges in the sensor's file

  bool operator==(const SensorChoices&) const = default;
};

}  // namespace proxarm::description
