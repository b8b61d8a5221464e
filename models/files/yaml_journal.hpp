// Records what readers ask of a YAML file: each key with its kind, unit, range and default. These facts exist only in
// the reading calls (yaml_file.hpp, yaml_rules.hpp). `proxarm schema` makes schemas and reference tables from what a
// journal records while example files are read.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "models/files/json.hpp"
#include "models/files/yaml_file.hpp"

namespace proxarm::description {

struct YamlFact {
  enum class Kind : std::uint8_t {
    asked,        // the reader asks whether the key is there
    required,     // required
    needed,       // required because of other values in the file
    refused,      // refused because of other values in the file
    otherwise,    // the default without the key
    map,          // a map ...
    names,        // a map with keys chosen by the user, matching `pattern` if that isn't empty
    exactly_one,  // a map that must have exactly one of `choices` as its keys
    list,
    numbers,
    number,
    integer,
    boolean,
    text,
    path,
    choice,
    // Restrictions of a kind:
    values,   // an integer out of these only
    pattern,  // a text that matches this regular expression
    zero,     // a number that may also be 0, below its range
  };

  Kind kind;
  Range range{};
  std::size_t min_size = 0, max_size = std::numeric_limits<std::size_t>::max();
  std::vector<std::string> choices{};
  std::vector<std::int64_t> values{};
  std::string pattern{}, means{};  // means: the pattern in words
  Json otherwise{};
};

class YamlJournal {
 public:
  YamlJournal() = default;
  YamlJournal(const YamlJournal&) = delete;
  YamlJournal& operator=(const YamlJournal&) = delete;
  virtual ~YamlJournal() = default;

  // A fact about the entry `key` of `parent`, which may be absent; or, without a key, about an element of the list
  // `parent`.
  virtual void note(const YamlNode& parent, std::string_view key, const YamlFact& fact) = 0;
};

// While it exists, `journal` records the files that this thread reads. One at a time.
class YamlListening {
 public:
  explicit YamlListening(YamlJournal& journal) noexcept;
  YamlListening(const YamlListening&) = delete;
  YamlListening& operator=(const YamlListening&) = delete;
  ~YamlListening();
};

// Passes a fact to the active journal, if any.
void note(const YamlNode& parent, std::string_view key, const YamlFact& fact);

// Whether a journal is active; saves copying for a note without one.
bool is_heard() noexcept;

}  // namespace proxarm::description
