// Rules that go beyond a single number's range, as calls: so that whoever listens to a reader (yaml_journal.hpp) hears
// them too. All throw SetupError, as YamlNode's own functions do.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "models/files/yaml_file.hpp"

namespace proxarm::description {

// What texts may look like: a regular expression (ECMAScript), which must fit all of the text, and what it is in words.
struct Pattern {
  const char* expression;
  const char* means;  // "a name of letters …"
};
std::string text_like(const YamlNode& node, std::string_view key, const Pattern& pattern);

// A text of at most that many bytes.
std::string text_up_to(const YamlNode& node, std::string_view key, std::string_view otherwise, std::size_t most);

// The keys of a map whose keys are names like this.
std::vector<std::string> names_like(const YamlNode& node, const Pattern& pattern);

// A whole number out of a few.
std::int64_t integer_of(const YamlNode& node, std::string_view key, const std::vector<std::int64_t>& values);
std::int64_t integer_of_or(const YamlNode& node, std::string_view key, std::int64_t otherwise,
                           const std::vector<std::int64_t>& values);

// 0, which means `zero`, or a number in the range.
double number_or_zero(const YamlNode& node, std::string_view key, double otherwise, Range range,
                      const std::string& zero);

// `node` must have exactly one of these keys; returns which. `expected` says so in words.
std::string exactly_one(const YamlNode& node, const std::vector<std::string>& keys, std::string_view expected);

// The one entry of `node` whose key is among `kinds`, and what it says. `what` and `example` are for whoever wrote
// another.
std::pair<std::string, YamlNode> one_entry(const YamlNode& node, const std::vector<std::string>& kinds,
                                           const std::string& what, const std::string& example);

// The key must be there, must be a number of at most that, or must not be there, because of what else the file says.
// `expected`, `found` and `advice` are as of error_at().
void require_key(const YamlNode& node, std::string_view key, const std::string& expected,
                 const std::string& advice = {});
void require_at_most(const YamlNode& node, std::string_view key, double value, double most,
                     const std::string& expected);
void refuse_key(const YamlNode& node, std::string_view key, const std::string& expected, const std::string& found = {});

}  // namespace proxarm::description
