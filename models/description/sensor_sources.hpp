// Reads the sources of a sensor's file: the documents that its identifiers, bytes, scales, states and commands come
// from. The sources are for people who read the file, and for `proxarm check`.
//
//   sources: ["the maker's manual, 1.82, page 9: identifiers and commands", ...]
//   one_source_only: "the rate command: a driver of others alone"        facts that have no second source
#pragma once

#include <string>
#include <vector>

namespace proxarm::description {

class YamlNode;

struct SensorSources {
  std::vector<std::string> sources;
  std::string one_source_only;  // empty: each fact has two sources
};

// Returns the sources, or empty fields if the file has no such keys. Throws SetupError.
SensorSources read_sensor_sources(const YamlNode& root);

}  // namespace proxarm::description
