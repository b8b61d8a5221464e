// The sources of a sensor's file, from which its identifiers, bytes, scales, states and commands come. For readers and
// `proxarm check`.
//
//   sources: ["the maker's manual, 1.82, page 9: identifiers and commands", ...]
//   one_source_only: "the rate command: a driver of others alone"        facts without a second source
#pragma once

#include <string>
#include <vector>

namespace proxarm::description {

class YamlNode;

struct SensorSources {
  std::vector<std::string> sources;
  std::string one_source_only;  // empty: each fact has two sources
};

// Throws SetupError. Returns empty fields if the file has no such keys.
SensorSources read_sensor_sources(const YamlNode& root);

}  // namespace proxarm::description
