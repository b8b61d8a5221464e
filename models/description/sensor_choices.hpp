// A cell's choices for its own sensor, beyond the sensor's file: identifiers, numbers, divisors and ranges of this
// unit.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace proxarm::description {

// A value for one of the `settings` of the sensor's file (sensor_protocol.hpp).
struct SensorSettingChoice {
  std::string name{};
  std::int64_t value = 0;
  int line = 0;  // of the cell's file

  bool operator==(const SensorSettingChoice&) const = default;
};

struct SensorChoices {
  std::filesystem::path file{};  // the cell's, for error messages
  std::vector<SensorSettingChoice> settings{};
  std::optional<std::array<double, 3>> force_range_N{}, torque_range_Nm{};  // replace those of the sensor's file

  bool operator==(const SensorChoices&) const = default;
};

}  // namespace proxarm::description
