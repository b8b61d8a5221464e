// Records what readers ask of a YAML file: each key with its kind, unit, range and default. These facts are stated only
// in the reading calls (yaml_file.hpp, yaml_rules.hpp). A journal records them while example files are read, and
// `proxarm schema` makes schemas and reference tables from the record.
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
    asked,        // the reader asks whether the key exists
    required,     // the key is required
    needed,       // the key is required because of other values in the file
    refused,      // the key is refused because of other values in the file
    otherwise,    // the value that the reader uses without the key
    map,          // a map whose keys follow as separate facts
    names,        // a map whose keys are chosen by the user, and match `pattern` if `pattern` isn't empty
    exactly_one,  // a map that must have exactly one of `choices` as its keys
    list,
    numbers,
    number,
    integer,
    boolean,
    text,
    path,
    choice,
    // The following kinds restrict another kind:
    values,   // an integer that must be one of `values`
    pattern,  // a text that matches this regular expression
    zero,     // a number that may also be 0, although 0 is below its range
  };

  Kind kind;
  Range range{};
  std::size_t min_size = 0, max_size = std::numeric_limits<std::size_t>::max();
  std::vector<std::string> choices{};
  std::vector<std::int64_t> values{};
  std::string pattern{}, means{};  // means: the pattern's meaning in words
  Json otherwise{};
};

class YamlJournal {
 public:
  YamlJournal() = default;
  YamlJournal(const YamlJournal&) = delete;
  YamlJournal& operator=(const YamlJournal&) = delete;
  virtual ~YamlJournal() = default;

  // Records a fact about the entry `key` of `parent`, which may be absent. If `key` is empty, the fact is about an
  // element of the list `parent`.
  virtual void note(const YamlNode& parent, std::string_view key, const YamlFact& fact) = 0;
};

// While this object exists, `journal` records the files that this thread reads. Only one such object may exist at a
// time.
class YamlListening {
 public:
  explicit YamlListening(YamlJournal& journal) noexcept;
  YamlListening(const YamlListening&) = delete;
  YamlListening& operator=(const YamlListening&) = delete;
  ~YamlListening();
};

// Passes a fact to the active journal, if there is one.
void note(const YamlNode& parent, std::string_view key, const YamlFact& fact);

// Whether a journal is active. Callers ask this first, so that they needn't copy data for a fact that no journal
// records.
bool is_heard() noexcept;

}  // namespace proxarm::description
