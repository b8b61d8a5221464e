#include "controller/extras/schema/key_tables.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>

#include "models/base/setup_error.hpp"

namespace proxarm::command_line {
namespace {

using description::number_text;

std::string code(const std::string& text) { return "`" + text + "`"; }

std::string joined(const std::vector<std::string>& parts, const char* between) {
  std::string text;
  for (const std::string& part : parts) text += (text.empty() ? "" : between) + part;
  return text;
}

// Returns a value as a file states it: without quotes, and without the .0 of a whole number.
std::string word(const description::Json& value) {
  const std::string text = value.dump();
  if (text.front() == '"') return text.substr(1, text.size() - 2);
  std::string plain;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool whole =
        text.compare(i, 2, ".0") == 0 && std::string(",]").find(text.c_str()[i + 2]) != std::string::npos;
    if (whole || (text.compare(i, 2, ".0") == 0 && i + 2 == text.size())) {
      ++i;
    } else {
      plain += text[i];
      if (text[i] == ',') plain += ' ';
    }
  }
  return plain;
}

std::string text_of(const Condition& condition) {
  if (condition.kind == Condition::Kind::there) return "with " + code(condition.key);
  if (condition.kind == Condition::Kind::absent) return "without " + code(condition.key);
  std::vector<std::string> values;
  for (const auto& value : condition.values) values.push_back(word(value));
  return code(condition.key + ": " + joined(values, ", "));
}

std::string text_of(const std::vector<Condition>& when) {
  std::vector<std::string> parts;
  for (const Condition& condition : when) parts.push_back(text_of(condition));
  return joined(parts, ", ");
}

std::string number_or_power(double value) {
  const double size = std::abs(value);
  const std::string sign = value < 0.0 ? "−" : "";
  for (const int bits : {15, 16, 29, 31, 32}) {
    if (size == std::ldexp(1.0, bits)) return sign + "2^" + std::to_string(bits);
    if (size == std::ldexp(1.0, bits) - 1.0) return sign + "2^" + std::to_string(bits) + " − 1";
  }
  if (size == 2.0 * std::numbers::pi) return sign + "2π";
  const int power = size > 0.0 ? static_cast<int>(std::floor(std::log10(size) + 1e-9)) : 0;
  const double digits = size / std::pow(10.0, power);
  if (power >= 5 && digits == std::floor(digits)) return sign + number_text(digits) + "e" + std::to_string(power);
  return sign + number_text(size);
}

std::string range_text(const Alternative& a) {
  const auto [min, max, above_min] = a.range;
  const bool low = min > std::numeric_limits<double>::lowest(), high = max < std::numeric_limits<double>::max();
  const std::string zero = a.zero ? "0, or " : "";
  if (low && high && min == -max) return zero + "±" + number_or_power(max);
  if (low && high && !above_min) return zero + number_or_power(min) + " to " + number_or_power(max);
  std::string text = low ? (above_min ? "above " : "at least ") + number_or_power(min) : "";
  if (high) text += (text.empty() ? "at most " : ", at most ") + number_or_power(max);
  return zero + (text.empty() ? "any" : text);
}

std::string count_text(const Alternative& a, const std::string& what) {
  if (a.min_size == a.max_size) return std::to_string(a.min_size) + " " + what;
  if (a.max_size == static_cast<std::size_t>(-1)) {
    return a.min_size == 0 ? what : std::to_string(a.min_size) + " or more " + what;
  }
  return std::to_string(a.min_size) + " to " + std::to_string(a.max_size) + " " + what;
}

std::string values_text(const std::vector<Alternative>& value);

bool has_maps(const std::vector<Alternative>& value) { return value.size() == 1 && value.front().map != nullptr; }

std::string count_of_letters(const Alternative& a) {
  return a.max_size == static_cast<std::size_t>(-1) ? "text" : "text, at most " + std::to_string(a.max_size) + " long";
}

std::string value_text(const Alternative& a) {
  using Kind = Alternative::Kind;
  std::vector<std::string> words;
  switch (a.kind) {
    case Kind::map:
      if (!a.map->keys_of.empty()) return "map of keys of " + code(a.map->keys_of);
      return a.map->names ? "map of " + values_text(a.map->keys.front().cases.front().value) + " by names" : "map";
    case Kind::list:
      if (has_maps(a.element)) return "list of " + count_text(a, "maps");
      return "list of " + count_text(a, "entries") + ": each " + values_text(a.element);
    case Kind::numbers:
      return count_text(a, "numbers") + ", " + range_text(a);
    case Kind::integer:
    case Kind::number:
      for (const std::int64_t one : a.values) words.push_back(std::to_string(one));
      return !words.empty() ? joined(words, ", ") : (a.kind == Kind::integer ? "whole, " : "") + range_text(a);
    case Kind::boolean:
      return "true, false";
    case Kind::choice:
      return joined(a.choices, ", ");
    case Kind::path:
      return "a file";
    case Kind::text:
      break;
  }
  return a.pattern.empty() ? count_of_letters(a) : a.means;
}

std::string values_text(const std::vector<Alternative>& value) {
  std::vector<std::string> kinds;
  for (const Alternative& a : value) kinds.push_back(value_text(a));
  return joined(kinds, "; or ");
}

std::string default_text(const KeyCase& one) {
  if (one.standing == Standing::required) return "–";
  std::vector<std::string> words;
  for (const description::Json& value : one.otherwise) words.push_back(word(value).empty() ? "none" : word(value));
  return joined(words, " or ");
}

// Returns the text with each | escaped, because | separates the table's columns.
std::string cell(const std::string& text) {
  std::string safe;
  for (const char c : text) safe += c == '|' ? std::string("\\|") : std::string(1, c);
  return safe;
}

// Collects texts with the conditions under which they apply. A text that applies in all cases has no condition.
class Cases {
 public:
  void add(const std::string& text, const std::vector<Condition>& when) {
    if (text.empty()) return;
    auto known = std::find_if(texts_.begin(), texts_.end(), [&](const auto& t) { return t.first == text; });
    if (known == texts_.end()) known = texts_.insert(texts_.end(), {text, {}});
    if (!when.empty()) known->second.push_back(text_of(when));
  }

  [[nodiscard]] std::string text(std::size_t all) const {
    std::vector<std::string> parts;
    for (const auto& [text, when] : texts_) {
      parts.push_back(when.empty() || when.size() == all ? text : text + " (" + joined(when, " or ") + ")");
    }
    return cell(joined(parts, "; "));
  }

 private:
  std::vector<std::pair<std::string, std::vector<std::string>>> texts_;
};

// Returns those cases of a key that are shown in a table. If the key's maps may have maps of defaults, only the cases
// without maps of defaults are shown.
std::vector<KeyCase> told(const KeyModel& key) {
  std::vector<KeyCase> cases = key.cases;
  if (std::erase_if(cases, [](const KeyCase& one) { return one.is_wide; }) == 0) return cases;
  for (KeyCase& one : cases) one.when.clear();
  return cases;
}

std::string row(const KeyModel& key, const std::string& unit) {
  Cases defaults, ranges;
  const std::vector<KeyCase> cases = told(key);
  for (const KeyCase& one : cases) {
    if (one.standing == Standing::refused) continue;
    defaults.add(default_text(one), one.when);
    ranges.add(values_text(one.value), one.when);
  }
  if (is_refused(key)) return "";
  return "| " + code(key.name) + " | " + unit + " | " + defaults.text(cases.size()) + " | " +
         ranges.text(cases.size()) + " | " + cell(key.meaning) + " |\n";
}

struct Table {
  std::vector<std::string> of{};
  std::string body;
};

void collect(const MapModel& map, const std::string& when, std::vector<Table>& tables);

void collect(const std::vector<Alternative>& value, const std::string& when, std::vector<Table>& tables) {
  for (const Alternative& a : value) {
    if (a.map != nullptr) collect(*a.map, when, tables);
    collect(a.element, when, tables);
  }
}

void collect(const MapModel& map, const std::string& when, std::vector<Table>& tables) {
  if (!map.keys_of.empty()) return;
  if (!map.names) {
    std::string body;
    if (!map.exactly_one.empty()) {
      std::vector<std::string> keys;
      for (const std::string& key : map.exactly_one) keys.push_back(code(key));
      body += "Exactly one of " + joined(keys, ", ") + " must be there.\n\n";
    }
    body += "| key | unit | default | range | meaning |\n|---|---|---|---|---|\n";
    for (const KeyModel& key : map.keys) body += row(key, unit_of(key));
    const std::string of = map.path.empty() ? "the file" : code(map.path) + when;
    const auto same = std::find_if(tables.begin(), tables.end(), [&](const Table& t) { return t.body == body; });
    if (same == tables.end()) {
      tables.push_back({{of}, body});
    } else if (std::find(same->of.begin(), same->of.end(), of) == same->of.end()) {
      same->of.push_back(of);
    }
  }
  for (const KeyModel& key : map.keys) {
    for (const KeyCase& one : told(key)) {
      collect(one.value, one.when.empty() ? when : when + ", " + text_of(one.when), tables);
    }
  }
}

}  // namespace

std::string key_tables(const MapModel& root, const std::string& kind) {
  std::vector<Table> tables;
  collect(root, "", tables);
  std::string text = "## Keys of a " + kind + " file\n";
  for (const Table& table : tables) text += "\nOf " + joined(table.of, ", ") + ":\n\n" + table.body;
  return text;
}

}  // namespace proxarm::command_line
