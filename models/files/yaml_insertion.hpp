// Inserts a key into the text of a YAML file and leaves everything else unchanged: comments, order, empty lines.
#pragma once

#include <string>
#include <vector>

namespace proxarm::description {

// A step of a path: a key, or the list member with this value of this key: {"drives"}, {"joint", "axis_1"}.
struct YamlStep {
  std::string key;
  std::string is{};  // empty: the map under `key`
};

// Inserts `key: value` into the map at the end of `path`, which begins at the file's outermost map. In a block map the
// key goes after the last key with a plain value on its line; in a map in braces after the first key. Returns false and
// changes nothing if there is no such map or line, or if the map has the key.
[[nodiscard]] bool insert_key(std::string& text, const std::vector<YamlStep>& path, const std::string& key,
                              const std::string& value);

// Whether such a map exists and has the key.
[[nodiscard]] bool has_key(const std::string& text, const std::vector<YamlStep>& path, const std::string& key);

}  // namespace proxarm::description
