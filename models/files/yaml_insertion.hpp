// Inserts a key into the text of a YAML file. Comments, order and empty lines remain unchanged.
#pragma once

#include <string>
#include <vector>

namespace proxarm::description {

// One step of a path through the file: a map's key, such as {"drives"}, or the list member whose key has a value, such
// as {"joint", "axis_1"}.
struct YamlStep {
  std::string key;
  std::string is{};  // the value of `key` in the list member; empty: the step leads to the map under `key`
};

// Inserts `key: value` into the map at the end of `path`; `path` begins at the file's outermost map. In a block map,
// the new key follows the last key with a plain value on its line. In a map in braces, it follows the first key.
// Returns false and changes nothing if there is no such map or no such line, or if the map already has the key.
[[nodiscard]] bool insert_key(std::string& text, const std::vector<YamlStep>& path, const std::string& key,
                              const std::string& value);

// Whether the map at the end of `path` exists and has the key.
[[nodiscard]] bool has_key(const std::string& text, const std::vector<YamlStep>& path, const std::string& key);

}  // namespace proxarm::description
