// What a cell says of its own sensor beyond the sensor's file: identifiers, numbers, divisors and ranges of this unit.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace proxarm::description {

// One of the sensor's file's `settings` (sensor_protocol.hpp).
struct SensorSettingChoice {
  std::string name{};
  std::int64_t value = 0;
  int line = 0;  // of the cell's file

  bool operator==(const SensorSettingChoice&) const = default;
};

struct SensorChoices {
  std::filesystem::path file{};  // the cell's, for messages
  std::vector<SensorSettingChoice> settings{};
  std::optional<std::array<double, 3>> force_range_N{}, torque_range_Nm{};  // instead of the sensor's file's

  bool operator==(const SensorChoices&) const = default;
};

}  // namespace proxarm::description
