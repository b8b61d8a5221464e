// Who listens to what a reader asks of a YAML file: each key with its kind, unit, range and default. The calls by which
// a reader reads (yaml_file.hpp, yaml_rules.hpp) are the one place of these facts; schemas and reference tables are
// made of what a listener hears while specimen files are read (`proxarm schema`).
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
    asked,        // whether it is there
    required,     // it must be there
    needed,       // the same, because of what else the file says
    refused,      // it must not be there, because of that
    otherwise,    // what it is without the key
    map,          // a map ...
    names,        // ... whose keys are names that the user chooses, like `pattern` if that isn't empty
    exactly_one,  // a map that must have exactly one of `choices` as its keys
    list,
    numbers,
    number,
    integer,
    boolean,
    text,
    path,
    choice,
    // What narrows a kind:
    values,   // of an integer: these alone
    pattern,  // of a text, a regular expression
    zero,     // of a number: 0 as well, below its range
  };

  Kind kind;
  Range range{};
  std::size_t min_size = 0, max_size = std::numeric_limits<std::size_t>::max();
  std::vector<std::string> choices{};
  std::vector<std::int64_t> values{};
  std::string pattern{}, means{};  // the latter in words
  Json otherwise{};
};

class YamlJournal {
 public:
  YamlJournal() = default;
  YamlJournal(const YamlJournal&) = delete;
  YamlJournal& operator=(const YamlJournal&) = delete;
  virtual ~YamlJournal() = default;

  // Of the entry `key` of `parent`, which may be absent; or of an element of the list `parent`, without a key.
  virtual void note(const YamlNode& parent, std::string_view key, const YamlFact& fact) = 0;
};

// Files that this thread reads while it lives are heard by `journal`. One at a time.
class YamlListening {
 public:
  explicit YamlListening(YamlJournal& journal) noexcept;
  YamlListening(const YamlListening&) = delete;
  YamlListening& operator=(const YamlListening&) = delete;
  ~YamlListening();
};

// Tells the journal that listens, if one does.
void note(const YamlNode& parent, std::string_view key, const YamlFact& fact);

// Whether one does: who would have to copy much for a note asks first.
bool is_heard() noexcept;

}  // namespace proxarm::description
