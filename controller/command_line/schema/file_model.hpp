// Builds a model of everything that a kind of file may hold. It merges the facts from all specimens; where they differ,
// it keeps the condition that distinguishes the cases.
//
// A specimen's comment names the keys on which another key depends; how it depends is learnt from the reader. A
// difference without such a key (bounds that are other keys' values) gets the range that the reader asked for first.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "controller/command_line/schema/specimen.hpp"

namespace proxarm::command_line {

// A condition on another key of the same map: it has one of these values (with `or_absent`: or is absent), is present,
// or is absent.
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
  description::Range outer{};  // the range that the reader asked for first, which holds whatever other keys say
  bool zero = false;           // 0 is also allowed
  bool is_bounded = true;      // false: its bounds are other keys' values
  std::size_t min_size = 0, max_size = static_cast<std::size_t>(-1);
  std::vector<std::string> choices{};
  std::vector<std::int64_t> values{};
  std::string pattern{}, means{};
  std::shared_ptr<const MapModel> map{};
  std::vector<Alternative> element{};
};

struct KeyCase {
  std::vector<Condition> when{};  // all must hold
  Standing standing = Standing::optional;
  std::vector<description::Json> otherwise{};  // the default; several if other keys choose among them
  std::vector<Alternative> value{};
  bool is_wide = false;  // defaults for such maps may set its keys elsewhere, so no key is required here (wide_map.hpp)
};

struct KeyModel {
  std::string name;
  std::string meaning{};
  std::vector<KeyCase> cases{};  // one without a condition, or several
};

// Returns the unit that a number of this key has by its name; empty if it isn't a number.
std::string unit_of(const KeyModel& key);

// Returns whether the key is refused in every case.
bool is_refused(const KeyModel& key) noexcept;

struct MapModel {
  std::string path;
  std::vector<KeyModel> keys{};
  std::optional<std::string>
      names{};  // pattern of keys that are names of the user's choice; `keys` then has one model for all
  std::vector<std::string> exactly_one{};
  std::string keys_of{};  // not empty: its keys are a subset of the keys of the maps at that path
};

// Throws SetupError if the specimens are incomplete: a key in no specimen, a key without a meaning, a choice that
// decides about other keys and that no specimen makes.
MapModel model_of(const Specimens& specimens);

}  // namespace proxarm::command_line
