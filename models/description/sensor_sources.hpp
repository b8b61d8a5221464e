// Where a sensor's file has its identifiers, bytes, scales, states and commands from: for people, and for `proxarm
// check`.
//
//   sources: ["the maker's manual, 1.82, page 9: identifiers and commands", ...]
//   one_source_only: "the rate command: a driver of others alone"        what no second source was found for
#pragma once

#include <string>
#include <vector>

namespace proxarm::description {

class YamlNode;

struct SensorSources {
  std::vector<std::string> sources;
  std::string one_source_only;  // empty: each figure is in two
};

// Throws SetupError. Of a file that says nothing, nothing.
SensorSources read_sensor_sources(const YamlNode& root);

}  // namespace proxarm::description
