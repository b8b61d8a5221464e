#include "controller/extras/schema/wide_map.hpp"

#include <algorithm>
#include <sstream>

#include "models/base/setup_error.hpp"

namespace proxarm::command_line {
namespace {

MapModel wide(const MapModel& map);

template <class Word>
void unite(std::vector<Word>& all, const std::vector<Word>& more) {
  for (const Word& word : more) {
    if (std::find(all.begin(), all.end(), word) == all.end()) all.push_back(word);
  }
}

// Widens `a` to all values that `a` or `b` accepts.
void unite(Alternative& a, const Alternative& b) {
  if (b.range.min < a.range.min) a.range.above_min = b.range.above_min;
  if (b.range.min == a.range.min) a.range.above_min = a.range.above_min && b.range.above_min;
  a.range.min = std::min(a.range.min, b.range.min);
  a.range.max = std::max(a.range.max, b.range.max);
  a.min_size = std::min(a.min_size, b.min_size);
  a.max_size = std::max(a.max_size, b.max_size);
  unite(a.choices, b.choices);
  unite(a.values, b.values);
}

KeyModel wide(const KeyModel& key) {
  KeyModel all{.name = key.name, .meaning = key.meaning, .cases = {{.is_wide = true}}};
  KeyCase& only = all.cases.front();
  for (const KeyCase& one : key.cases) {
    if (one.standing == Standing::refused) continue;
    if (only.otherwise.empty()) only.otherwise = one.otherwise;
    for (const Alternative& value : one.value) {
      const auto same = std::find_if(only.value.begin(), only.value.end(),
                                     [&](const Alternative& a) { return a.kind == value.kind; });
      if (same != only.value.end()) {
        unite(*same, value);
        continue;
      }
      only.value.push_back(value);
      if (value.map != nullptr) only.value.back().map = std::make_shared<MapModel>(wide(*value.map));
    }
  }
  return all;
}

MapModel wide(const MapModel& map) {
  MapModel all{.path = map.path, .keys = {}, .names = map.names, .exactly_one = {}, .keys_of = map.path};
  for (const KeyModel& key : map.keys) {
    if (!is_refused(key)) all.keys.push_back(wide(key));
  }
  return all;
}

// Returns the key of this name, const if `map` is. Throws SetupError if there is none.
auto& key_of(auto& map, const std::string& name) {
  const auto found = std::ranges::find(map.keys, name, &KeyModel::name);
  if (found != map.keys.end()) return *found;
  throw description::SetupError({.key = map.path + "." + name, .message = "the specimens don't have this key"});
}

// Returns the map at a path such as drives[].simulation. Of each key on the path, the first case counts.
const MapModel& map_at(const MapModel& root, const std::string& path) {
  const MapModel* map = &root;
  std::istringstream names(path);
  for (std::string name; std::getline(names, name, '.');) {
    const bool list = name.ends_with("[]");
    const Alternative& value = key_of(*map, list ? name.substr(0, name.size() - 2) : name).cases.front().value.front();
    map = (list ? value.element.front() : value).map.get();
  }
  return *map;
}

// Changes the list `key` so that its maps may get their keys from the maps of defaults in `sharing`: in a file with one
// of these, the list's maps require no key.
void widen_list(KeyModel& key, const std::vector<std::string>& sharing) {
  KeyCase any = key.cases.front();
  any.is_wide = true;
  Alternative& element = any.value.front().element.front();
  element.map = std::make_shared<MapModel>(wide(*element.map));
  for (const std::string& other : sharing) {
    key.cases.front().when.push_back({.kind = Condition::Kind::absent, .key = other});
  }
  key.cases.insert(key.cases.begin(), any);
}

}  // namespace

void share_keys(MapModel& root, const Specimens& specimens) {
  // Keys of lists, each with the keys of the maps of defaults that apply to the list's maps.
  std::vector<std::pair<std::string, std::vector<std::string>>> lists;
  for (KeyModel& key : root.keys) {
    const std::string path = specimens.shared_by(root.path, key.name);
    if (path.empty()) continue;
    auto shared = std::make_shared<MapModel>(wide(map_at(root, path)));
    for (const KeyCase& one : key.cases) {
      for (const Alternative& value : one.value) {
        if (value.map == nullptr) continue;
        for (const KeyModel& refused : value.map->keys) {
          std::erase_if(shared->keys, [&](const KeyModel& k) { return k.name == refused.name && is_refused(refused); });
        }
      }
    }
    key.cases = {{.value = {{.kind = Alternative::Kind::map, .map = shared}}}};
    const std::string list = path.substr(0, path.find("[]"));
    if (lists.empty() || lists.back().first != list) lists.push_back({list, {}});
    lists.back().second.push_back(key.name);
  }
  for (const auto& [list, sharing] : lists) widen_list(key_of(root, list), sharing);
}

}  // namespace proxarm::command_line
