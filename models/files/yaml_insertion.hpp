// A key put into the text of a YAML file, with all else of it as it was: comments, order, empty lines.
#pragma once

#include <string>
#include <vector>

namespace proxarm::description {

// A key, or the `name` key of a list's member and what it has there: {"drives"}, {"joint", "axis_1"}.
struct YamlStep {
  std::string key;
  std::string is{};  // empty: the map behind `key`
};

// Puts `key: value` into the map at the end of `path`, from the file's outermost one. In a map of lines it comes behind
// the last key that has a plain value on its own line; in one in braces behind the first. False, and nothing changed,
// where there is no such map, it has the key, or it has no such line.
[[nodiscard]] bool insert_key(std::string& text, const std::vector<YamlStep>& path, const std::string& key,
                              const std::string& value);

// Whether there is such a map and it has the key.
[[nodiscard]] bool has_key(const std::string& text, const std::vector<YamlStep>& path, const std::string& key);

}  // namespace proxarm::description
