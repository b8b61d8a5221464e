// What a kind of file may hold, in one piece: the facts of all specimens' places put together, and where they differ
// the condition that tells the cases apart.
//
// A specimen's comment says by which keys another one differs; how it does is heard. What differs without such a key
// (bounds that are other keys' values) is left as wide as the reader first asked.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "controller/command_line/schema/specimen.hpp"

namespace proxarm::command_line {

// On a key beside: that it has one of these values (`or_absent`: or isn't there), or that it is there, or isn't.
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
  description::Range outer{};  // what the reader asked first: the bounds whatever other keys say
  bool zero = false;           // 0 as well
  bool is_bounded = true;      // false: its bounds are what other keys say
  std::size_t min_size = 0, max_size = static_cast<std::size_t>(-1);
  std::vector<std::string> choices{};
  std::vector<std::int64_t> values{};
  std::string pattern{}, means{};
  std::shared_ptr<const MapModel> map{};
  std::vector<Alternative> element{};
};

struct KeyCase {
  std::vector<Condition> when{};  // all of them
  Standing standing = Standing::optional;
  std::vector<description::Json> otherwise{};  // one, or several that what else the file says chooses from
  std::vector<Alternative> value{};
  bool is_wide = false;  // keys may stand elsewhere for all such maps, so that none of them must be here (wide_map.hpp)
};

struct KeyModel {
  std::string name;
  std::string meaning{};
  std::vector<KeyCase> cases{};  // one without a condition, or several
};

// The unit that a number of this key has by its name; empty for what is no number.
std::string unit_of(const KeyModel& key);

// Whether the key must not be there in any case.
bool is_refused(const KeyModel& key) noexcept;

struct MapModel {
  std::string path;
  std::vector<KeyModel> keys{};
  std::optional<std::string> names{};  // keys are the user's names: `keys` has one, whose cases hold for each
  std::vector<std::string> exactly_one{};
  std::string keys_of{};  // not empty: its keys are some of the maps' at that path
};

// Throws SetupError if the specimens leave something open: a key that none of them has, a key without a meaning, a
// choice that decides about other keys and isn't made in any.
MapModel model_of(const Specimens& specimens);

}  // namespace proxarm::command_line
