// Checks rules that are more than a single number's range. Each rule is a function, so that a journal
// (yaml_journal.hpp) can record the rule. All functions throw SetupError, as YamlNode's functions do.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "models/files/yaml_file.hpp"

namespace proxarm::description {

// The form of a text: a regular expression (ECMAScript) that the whole text must match, and its meaning in words.
struct Pattern {
  const char* expression;
  const char* means;  // "a name of letters …"
};
std::string text_like(const YamlNode& node, std::string_view key, const Pattern& pattern);

// Returns a text of at most `most` bytes.
std::string text_up_to(const YamlNode& node, std::string_view key, std::string_view otherwise, std::size_t most);

// Returns the keys of a map. They must match the pattern.
std::vector<std::string> names_like(const YamlNode& node, const Pattern& pattern);

// Returns an integer, which must be one of `values`.
std::int64_t integer_of(const YamlNode& node, std::string_view key, const std::vector<std::int64_t>& values);
std::int64_t integer_of_or(const YamlNode& node, std::string_view key, std::int64_t otherwise,
                           const std::vector<std::int64_t>& values);

// Returns a number in the range, or 0. `zero`: what 0 means.
double number_or_zero(const YamlNode& node, std::string_view key, double otherwise, Range range,
                      const std::string& zero);

// Returns the one key of `keys` that `node` has. `node` must have exactly one. `expected` describes the keys in words.
std::string exactly_one(const YamlNode& node, const std::vector<std::string>& keys, std::string_view expected);

// Returns key and value of the one entry of `node` whose key is among `kinds`. `what` and `example` are for the message
// if there isn't exactly one.
std::pair<std::string, YamlNode> one_entry(const YamlNode& node, const std::vector<std::string>& kinds,
                                           const std::string& what, const std::string& example);

// Because of other values in the file, the key must be present (require_key), must be a number of at most `most`
// (require_at_most), or must be absent (refuse_key). `expected`, `found` and `advice` mean the same as in error_at().
void require_key(const YamlNode& node, std::string_view key, const std::string& expected,
                 const std::string& advice = {});
void require_at_most(const YamlNode& node, std::string_view key, double value, double most,
                     const std::string& expected);
void refuse_key(const YamlNode& node, std::string_view key, const std::string& expected, const std::string& found = {});

}  // namespace proxarm::description
