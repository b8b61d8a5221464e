// Rules beyond a single number's range, as calls, so that a journal (yaml_journal.hpp) records them too. All throw
// SetupError, like YamlNode's functions.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "models/files/yaml_file.hpp"

namespace proxarm::description {

// The form of a text: a regular expression (ECMAScript) for the whole text, and its meaning in words.
struct Pattern {
  const char* expression;
  const char* means;  // "a name of letters …"
};
std::string text_like(const YamlNode& node, std::string_view key, const Pattern& pattern);

// A text of at most `most` bytes.
std::string text_up_to(const YamlNode& node, std::string_view key, std::string_view otherwise, std::size_t most);

// The keys of a map, which must match the pattern.
std::vector<std::string> names_like(const YamlNode& node, const Pattern& pattern);

// An integer out of a few.
std::int64_t integer_of(const YamlNode& node, std::string_view key, const std::vector<std::int64_t>& values);
std::int64_t integer_of_or(const YamlNode& node, std::string_view key, std::int64_t otherwise,
                           const std::vector<std::int64_t>& values);

// 0, with the meaning `zero`, or a number in the range.
double number_or_zero(const YamlNode& node, std::string_view key, double otherwise, Range range,
                      const std::string& zero);

// `node` must have exactly one of these keys; returns it. `expected` describes them in words.
std::string exactly_one(const YamlNode& node, const std::vector<std::string>& keys, std::string_view expected);

// The one entry of `node` whose key is among `kinds`: key and value. `what` and `example` are for the message
// otherwise.
std::pair<std::string, YamlNode> one_entry(const YamlNode& node, const std::vector<std::string>& kinds,
                                           const std::string& what, const std::string& example);

// Because of other values in the file, the key must be present, must be a number of at most `most`, or must be absent.
// `expected`, `found` and `advice` as in error_at().
void require_key(const YamlNode& node, std::string_view key, const std::string& expected,
                 const std::string& advice = {});
void require_at_most(const YamlNode& node, std::string_view key, double value, double most,
                     const std::string& expected);
void refuse_key(const YamlNode& node, std::string_view key, const std::string& expected, const std::string& found = {});

}  // namespace proxarm::description
