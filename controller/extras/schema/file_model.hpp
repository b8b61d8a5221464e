// Builds a model of everything that a kind of file may hold. The model merges the facts from all specimens. Where the
// facts differ, the model has one case for each, with the condition that distinguishes the cases.
//
// A key's comment in a specimen names the keys on which that key depends. How the key depends on them is found from the
// reader's questions. If bounds differ and no named key explains it, because the bounds are other keys' values, the
// model has the range that the reader asked for first.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "controller/extras/schema/specimen.hpp"

namespace proxarm::command_line {

// A condition on another key of the same map. By `kind`, the key must have one of these values (with `or_absent`: or be
// absent), be there, or be absent.
struct Condition {
  enum class Kind : std::uint8_t { values, there, absent };
  Kind kind = Kind::values;
  std::string key{};
  std::vector<description::Json> values{};
  bool or_absent = false;
};

struct MapModel;

// One kind of value that a key may have.
struct Alternative {
  enum class Kind : std::uint8_t { map, list, numbers, number, integer, boolean, text, path, choice };
  Kind kind = Kind::text;
  description::Range range{};
  // The range that the reader asked for first, which applies whatever values other keys have.
  description::Range outer{};
  bool zero = false;       // 0 is also allowed
  bool is_bounded = true;  // false: the bounds are other keys' values
  std::size_t min_size = 0, max_size = static_cast<std::size_t>(-1);
  std::vector<std::string> choices{};
  std::vector<std::int64_t> values{};
  std::string pattern{}, means{};
  std::shared_ptr<const MapModel> map{};
  std::vector<Alternative> element{};
};

struct KeyCase {
  std::vector<Condition> when{};  // conditions that must all be true
  Standing standing = Standing::optional;
  std::vector<description::Json> otherwise{};  // the default; several defaults if other keys choose one of them
  std::vector<Alternative> value{};
  // The value is a map (or a list of maps) whose keys may be set elsewhere as defaults, so no key is required here
  // (wide_map.hpp).
  bool is_wide = false;
};

struct KeyModel {
  std::string name;
  std::string meaning{};
  std::vector<KeyCase> cases{};  // one case without a condition, or several cases with conditions
};

// Returns the unit of the key's numbers, taken from the key's name; empty if the key's values aren't numbers.
std::string unit_of(const KeyModel& key);

// Returns whether the key is refused in every case.
bool is_refused(const KeyModel& key) noexcept;

struct MapModel {
  std::string path;
  std::vector<KeyModel> keys{};
  std::optional<std::string>
      // If the map's keys are names of the user's choice: the pattern of these names. `keys` then has one model for all
      // names.
      names{};
  std::vector<std::string> exactly_one{};
  std::string keys_of{};  // if not empty, this map's keys are a subset of the keys of the maps at that path
};

// Builds the model of a kind of file. Throws SetupError if the specimens are incomplete: if a key is in no specimen, if
// a key has no meaning, or if no specimen makes a choice that decides about other keys.
MapModel model_of(const Specimens& specimens);

}  // namespace proxarm::command_line
