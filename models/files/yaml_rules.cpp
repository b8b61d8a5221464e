#include "models/files/yaml_rules.hpp"

#include <algorithm>
#include <regex>

#include "models/base/text.hpp"
#include "models/files/yaml_journal.hpp"

namespace proxarm::description {
namespace {

std::string words_of(const std::vector<std::int64_t>& values) {
  std::vector<std::string> words;
  for (const std::int64_t value : values) words.push_back(std::to_string(value));
  return one_of(words);
}

std::vector<std::string> there(const YamlNode& node, const std::vector<std::string>& keys) {
  std::vector<std::string> found;
  std::copy_if(keys.begin(), keys.end(), std::back_inserter(found),
               [&](const std::string& key) { return node.has(key); });
  return found;
}

}  // namespace

std::string text_like(const YamlNode& node, std::string_view key, const Pattern& pattern) {
  std::string text = node.string(key);
  if (is_heard())
    note(node, key, {.kind = YamlFact::Kind::pattern, .pattern = pattern.expression, .means = pattern.means});
  // The length is limited because regex_match() recurses once per character. Patterns allow some dozens of characters.
  if (text.size() > 256 || !std::regex_match(text, std::regex(pattern.expression))) {
    throw node.error_at(key, pattern.means);
  }
  return text;
}

std::string text_up_to(const YamlNode& node, std::string_view key, std::string_view otherwise, std::size_t most) {
  std::string text = node.string_or(key, otherwise);
  if (is_heard()) note(node, key, {.kind = YamlFact::Kind::text, .max_size = most});
  if (text.size() > most) throw node.error_at(key, "at most " + std::to_string(most) + " characters");
  return text;
}

std::vector<std::string> names_like(const YamlNode& node, const Pattern& pattern) {
  std::vector<std::string> names = node.keys();
  if (is_heard()) note(node, {}, {.kind = YamlFact::Kind::names, .pattern = pattern.expression});
  const std::regex expression(pattern.expression);
  for (const std::string& name : names) {
    if (!std::regex_match(name, expression)) {
      throw node.error_at(name, std::string(pattern.means) + " as the key", in_quotes(name));
    }
  }
  return names;
}

std::int64_t integer_of(const YamlNode& node, std::string_view key, const std::vector<std::int64_t>& values) {
  const auto [least, most] = std::minmax_element(values.begin(), values.end());
  if (is_heard()) note(node, key, {.kind = YamlFact::Kind::values, .values = values});
  const std::int64_t value = node.integer(key, *least, *most);
  if (std::find(values.begin(), values.end(), value) == values.end()) throw node.error_at(key, words_of(values));
  return value;
}

std::int64_t integer_of_or(const YamlNode& node, std::string_view key, std::int64_t otherwise,
                           const std::vector<std::int64_t>& values) {
  const auto [least, most] = std::minmax_element(values.begin(), values.end());
  static_cast<void>(node.integer_or(key, otherwise, *least, *most));
  if (is_heard()) note(node, key, {.kind = YamlFact::Kind::values, .values = values});
  return node.has(key) ? integer_of(node, key, values) : otherwise;
}

double number_or_zero(const YamlNode& node, std::string_view key, double otherwise, Range range,
                      const std::string& zero) {
  const double value = node.number_or(key, otherwise, 0.0, range.max);
  if (is_heard()) note(node, key, {.kind = YamlFact::Kind::zero, .range = range});
  if (value != 0.0 && !range.contains(value)) {
    const std::string unit = unit_of_key(key);
    throw node.error_at(key, "0 (" + zero + "), or " + number_text(range.min) + " to " + number_text(range.max) +
                                 (unit.empty() ? "" : " " + unit));
  }
  return value;
}

std::string exactly_one(const YamlNode& node, const std::vector<std::string>& keys, std::string_view expected) {
  if (is_heard()) note(node, {}, {.kind = YamlFact::Kind::exactly_one, .choices = keys});
  const std::vector<std::string> found = there(node, keys);
  if (found.size() == 1) return found.front();
  if (found.empty()) throw node.error_at(keys.front(), std::string(expected));
  throw node.error_at(found.back(), std::string(expected), found.front() + " and " + found.back());
}

std::pair<std::string, YamlNode> one_entry(const YamlNode& node, const std::vector<std::string>& kinds,
                                           const std::string& what, const std::string& example) {
  if (!node.is_map()) throw node.error(what + ", such as `" + example + "`");
  const bool known = std::any_of(kinds.begin(), kinds.end(), [&](const std::string& kind) { return node.has(kind); });
  if (!known) node.finish();  // reports an unknown kind and the nearest known kind
  const std::string kind = exactly_one(node, kinds, what + ": " + one_of(kinds));
  return {kind, node.map(kind)};
}

void require_key(const YamlNode& node, std::string_view key, const std::string& expected, const std::string& advice) {
  if (is_heard()) note(node, key, {.kind = YamlFact::Kind::needed});
  if (!node.has(key)) throw node.error_at(key, expected, "nothing", advice);
}

void require_at_most(const YamlNode& node, std::string_view key, double value, double most,
                     const std::string& expected) {
  if (is_heard()) {
    note(node, key, {.kind = YamlFact::Kind::number, .range = {std::numeric_limits<double>::lowest(), most}});
  }
  if (value > most) throw node.error_at(key, expected, number_text(value));
}

void refuse_key(const YamlNode& node, std::string_view key, const std::string& expected, const std::string& found) {
  if (is_heard()) note(node, key, {.kind = YamlFact::Kind::refused});
  if (node.has(key)) throw node.error_at(key, expected, found);
}

}  // namespace proxarm::description
