#include "controller/extras/schema/file_model.hpp"

#include <algorithm>
#include <limits>
#include <set>

#include "controller/extras/schema/json_schema.hpp"
#include "controller/extras/schema/wide_map.hpp"
#include "models/base/setup_error.hpp"

namespace proxarm::command_line {
namespace {

using description::Json;
using description::SetupError;
using description::YamlFact;
using Places = std::vector<const Place*>;

constexpr double lowest = std::numeric_limits<double>::lowest(), highest = std::numeric_limits<double>::max();

SetupError incomplete(const std::string& path, const std::string& key, const std::string& what) {
  return SetupError({.key = path.empty() ? key : path + "." + key, .message = "the specimens " + what});
}

std::optional<Alternative::Kind> kind_of(YamlFact::Kind kind) {
  switch (kind) {
    case YamlFact::Kind::list:
      return Alternative::Kind::list;
    case YamlFact::Kind::numbers:
      return Alternative::Kind::numbers;
    case YamlFact::Kind::number:
      return Alternative::Kind::number;
    case YamlFact::Kind::integer:
      return Alternative::Kind::integer;
    case YamlFact::Kind::boolean:
      return Alternative::Kind::boolean;
    case YamlFact::Kind::text:
      return Alternative::Kind::text;
    case YamlFact::Kind::path:
      return Alternative::Kind::path;
    case YamlFact::Kind::choice:
      return Alternative::Kind::choice;
    default:
      return std::nullopt;  // maps are known from the places, and the other facts don't tell the kind
  }
}

// Narrows `a` by a further fact from the same place, because all facts of one place apply.
void narrow(Alternative& a, const YamlFact& fact) {
  if (fact.range.min > a.range.min || (fact.range.min == a.range.min && fact.range.above_min)) {
    a.range.min = fact.range.min;
    a.range.above_min = fact.range.above_min;
  }
  a.range.max = std::min(a.range.max, fact.range.max);
  a.min_size = std::max(a.min_size, fact.min_size);
  a.max_size = std::min(a.max_size, fact.max_size);
  if (!fact.choices.empty()) a.choices = fact.choices;
}

bool has(const std::vector<Alternative>& all, Alternative::Kind kind) {
  return std::any_of(all.begin(), all.end(), [&](const Alternative& a) { return a.kind == kind; });
}

void leave_out(std::vector<Alternative>& all, Alternative::Kind kind) {
  std::erase_if(all, [&](const Alternative& a) { return a.kind == kind; });
}

// Returns the kinds of value, other than maps, that the reader takes for a key in one place.
std::vector<Alternative> scalars_of(const KeyFacts& facts) {
  using Kind = Alternative::Kind;
  std::vector<Alternative> all;
  for (const YamlFact& fact : facts.facts) {
    const auto kind = kind_of(fact.kind);
    if (!kind) continue;
    auto same = std::find_if(all.begin(), all.end(), [&](const Alternative& a) { return a.kind == *kind; });
    if (same == all.end()) same = all.insert(all.end(), Alternative{.kind = *kind, .outer = fact.range});
    narrow(*same, fact);
  }
  // The reader reads paths and choices also as texts, and lists of numbers also as lists, so these kinds are left out.
  if (has(all, Kind::path) || has(all, Kind::choice)) leave_out(all, Kind::text);
  if (has(all, Kind::numbers)) leave_out(all, Kind::list);
  for (const YamlFact& fact : facts.facts) {
    for (Alternative& a : all) {
      if (fact.kind == YamlFact::Kind::values) a.values = fact.values;
      if (fact.kind == YamlFact::Kind::pattern) a.pattern = fact.pattern, a.means = fact.means;
      if (fact.kind == YamlFact::Kind::zero) a.range = fact.range, a.zero = true;
    }
  }
  return all;
}

// Widens `a` to all values that `a` and `b`, from different places, accept. Bounds that differ depend on other keys'
// values. Returns whether `a` and `b` differ.
bool widen(Alternative& a, const Alternative& b) {
  bool differs = false;
  if (a.outer.min != b.outer.min) a.outer.min = lowest;
  if (a.outer.max != b.outer.max) a.outer.max = highest;
  if (a.range.min != b.range.min || a.range.above_min != b.range.above_min) {
    a.range.min = a.outer.min;
    a.range.above_min = a.outer.above_min;
    differs = true;
  }
  if (a.range.max != b.range.max) a.range.max = a.outer.max, differs = true;
  if (a.min_size != b.min_size) a.min_size = 0, differs = true;
  if (a.max_size != b.max_size) a.max_size = static_cast<std::size_t>(-1), differs = true;
  for (const std::string& choice : b.choices) {
    if (std::find(a.choices.begin(), a.choices.end(), choice) != a.choices.end()) continue;
    a.choices.push_back(choice);
    differs = true;
  }
  differs = differs || a.choices.size() != b.choices.size() || a.values != b.values || a.pattern != b.pattern;
  if (differs) a.is_bounded = false;
  return differs;
}

struct Found {
  KeyCase as{};
  int contradictions = 0;
};

Places children_of(const Places& places, const std::string& key, bool lists) {
  Places found;
  for (const Place* place : places) {
    for (const Place* child : place->children) {
      if (child->key == key && child->is_list == lists) found.push_back(child);
    }
  }
  return found;
}

class Builder {
 public:
  explicit Builder(const Specimens& specimens) : specimens_(specimens) {
    for (const Place* root : specimens.roots()) note_paths(*root);
  }

  // Builds the model of a map from all places with the map's path. Adds the number of unexplained contradictions to
  // `contradictions`.
  MapModel build(const Places& places, int& contradictions) const {
    MapModel model{.path = places.front()->path};
    model.exactly_one = places.front()->exactly_one;
    if (places.front()->names) return build_names(places, std::move(model), contradictions);
    for (const std::string& key : keys_of(places)) {
      KeyModel found{.name = key, .meaning = specimens_.meaning(model.path, key)};
      contradictions += split(key, places, {}, found.cases);
      model.keys.push_back(std::move(found));
    }
    return model;
  }

 private:
  static std::vector<std::string> keys_of(const Places& places) {
    std::vector<std::string> keys;
    for (const Place* place : places) {
      for (const KeyFacts& facts : place->asked) {
        if (std::find(keys.begin(), keys.end(), facts.key) == keys.end()) keys.push_back(facts.key);
      }
    }
    return keys;
  }

  // Builds the model of a map whose keys are names of the user's choice. The facts of all names are merged into one
  // key.
  MapModel build_names(const Places& places, MapModel model, int& contradictions) const {
    std::vector<std::unique_ptr<Place>> made;
    Places views;
    const auto make = [&](Place place) {
      made.push_back(std::make_unique<Place>(std::move(place)));
      return made.back().get();
    };
    for (const Place* place : places) {
      model.names = place->names;
      for (KeyFacts facts : place->asked) {
        Place* view = make({.path = place->path, .key = place->key});
        for (const Place* child : place->children) {
          if (child->key != facts.key) continue;
          Place* renamed = make(*child);
          renamed->key = "NAME";
          renamed->path = place->path + ".NAME";
          view->children.push_back(renamed);
        }
        facts.key = "NAME";
        facts.standing = Standing::optional;
        view->asked.push_back(std::move(facts));
        views.push_back(view);
      }
    }
    if (views.empty()) throw incomplete(model.path, "NAME", "have no name here");
    KeyModel each{.name = "NAME"};
    contradictions += split("NAME", views, {}, each.cases);
    model.keys.push_back(std::move(each));
    return model;
  }

  // Merges the facts that these places have about a key.
  Found summarise(const std::string& key, const Places& places) const {
    Found found;
    std::optional<Standing> standing;
    std::map<std::string, Json> defaults;
    bool some_without = false;
    Places askers;
    for (const Place* place : places) {
      const KeyFacts* facts = place->find(key);
      const Standing here = facts == nullptr ? Standing::refused : facts->standing;
      if (standing && *standing != here) ++found.contradictions;
      standing = standing && *standing != here ? Standing::optional : here;
      if (here == Standing::refused) continue;
      askers.push_back(place);
      if (facts->otherwise) defaults.emplace(facts->otherwise->dump(), *facts->otherwise);
      some_without = some_without || !facts->otherwise;
    }
    // A default that the comment states takes precedence, because such a default is another key's value, or follows
    // from one.
    const bool in_words = specimens_.meaning(places.front()->path, key).find("default:") != std::string::npos;
    if (!some_without && !in_words) {
      for (const auto& [text, value] : defaults) found.as.otherwise.push_back(value);
    }
    found.as.standing = standing.value_or(Standing::refused);
    found.as.value = value_of(key, askers, found.contradictions);
    return found;
  }

  std::vector<Alternative> value_of(const std::string& key, const Places& places, int& contradictions) const {
    std::vector<Alternative> all;
    std::set<std::string> kinds;
    for (const Place* place : places) {
      const KeyFacts* facts = place->find(key);
      if (facts == nullptr) continue;
      if (const std::string read = kinds_of(*place, *facts); !read.empty()) kinds.insert(read);
      for (const Alternative& one : scalars_of(*facts)) {
        auto same = std::find_if(all.begin(), all.end(), [&](const Alternative& a) { return a.kind == one.kind; });
        if (same == all.end()) {
          all.push_back(one);
        } else {
          contradictions += widen(*same, one) ? 1 : 0;
        }
      }
    }
    if (kinds.size() > 1) ++contradictions;
    if (has(all, Alternative::Kind::numbers)) return all;
    const Places lists = children_of(places, key, true), maps = children_of(places, key, false);
    if (!lists.empty()) {
      for (Alternative& a : all) {
        if (a.kind == Alternative::Kind::list) a.element = value_of("", lists, contradictions);
      }
    }
    if (!maps.empty()) {
      all.push_back({.kind = Alternative::Kind::map});
      all.back().map = std::make_shared<MapModel>(build(maps, contradictions));
    }
    return all;
  }

  // Returns the kinds of value that the reader takes for a key in this place, as letters; empty if the reader only
  // asked whether the key is there.
  static std::string kinds_of(const Place& place, const KeyFacts& facts) {
    std::string kinds;
    for (const Alternative& a : scalars_of(facts)) kinds += static_cast<char>('a' + static_cast<int>(a.kind));
    for (const Place* child : place.children) {
      if (child->key == facts.key && !child->is_list && !facts.key.empty()) kinds = "map";
    }
    return kinds;
  }

  // Returns the key's value here, as the reader takes it, if other keys may depend on it; nullopt if no key can depend
  // on it.
  static std::optional<std::string> decision(const Place& place, const KeyFacts& facts) {
    const auto here = place.there.find(facts.key);
    for (const YamlFact& fact : facts.facts) {
      const bool choice = fact.kind == YamlFact::Kind::choice, truth = fact.kind == YamlFact::Kind::boolean;
      if (!choice && !truth && fact.kind != YamlFact::Kind::values) continue;
      if (here != place.there.end()) return "=" + here->second;
      if (!facts.otherwise) return "-";
      const std::string text = facts.otherwise->dump();
      return "=" + (text.front() == '"' ? text.substr(1, text.size() - 2) : text);
    }
    if (facts.otherwise) return std::nullopt;
    return here != place.there.end() ? "+" : "-";
  }

  // Returns those keys named in this key's comment about which a reader asked in all of these places, and whose values
  // differ among the places.
  std::vector<std::string> deciders(const std::string& key, const Places& places) const {
    std::vector<std::string> all;
    for (const std::string& decider : specimens_.deciders(places.front()->path, key)) {
      std::set<std::string> values;
      bool decides = true;
      for (const Place* place : places) {
        const KeyFacts* here = place->find(decider);
        const auto value = here != nullptr ? decision(*place, *here) : std::nullopt;
        decides = decides && value && here->standing != Standing::refused;
        if (decides) values.insert(*value);
      }
      if (decides && values.size() > 1) all.push_back(decider);
    }
    return all;
  }

  using Groups = std::map<std::string, Places>;

  static Groups grouped(const Places& places, const std::string& decider) {
    Groups groups;
    for (const Place* place : places) groups[*decision(*place, *place->find(decider))].push_back(place);
    return groups;
  }

  // Splits the key's facts into cases without contradictions, and adds these to `cases`. Returns the number of
  // contradictions that remain.
  int split(const std::string& key, const Places& places, const std::vector<Condition>& when,
            std::vector<KeyCase>& cases) const {
    const Found whole = summarise(key, places);
    // Takes the first decider whose groups have fewer contradictions. If there is none, takes the first decider,
    // because within its groups another decider may reduce the contradictions.
    std::string best;
    if (whole.contradictions > 0) {
      for (const std::string& decider : deciders(key, places)) {
        int left = 0;
        for (const auto& [value, group] : grouped(places, decider)) left += summarise(key, group).contradictions;
        if (best.empty()) best = decider;
        if (left >= whole.contradictions) continue;
        best = decider;
        break;
      }
    }
    if (best.empty()) {
      cases.push_back(whole.as);
      cases.back().when = when;
      fill(key, places.front()->path, cases.back());
      return whole.contradictions;
    }
    // Groups for which the key has the same facts become one case.
    std::map<std::string, std::pair<Places, std::vector<std::string>>> same;
    for (const auto& [value, group] : grouped(places, best)) {
      auto& [together, values] = same[signature(summarise(key, group).as)];
      together.insert(together.end(), group.begin(), group.end());
      values.push_back(value);
    }
    require_choices(best, places);
    int left = 0;
    for (const auto& [text, group] : same) {
      std::vector<Condition> narrower = when;
      narrower.push_back(condition(best, group.second, places));
      left += split(key, group.first, narrower, cases);
    }
    return left;
  }

  static std::string signature(const KeyCase& as) {
    return schema_of(as.value).dump() + std::to_string(static_cast<int>(as.standing)) + Json(as.otherwise).dump();
  }

  static Condition condition(const std::string& key, const std::vector<std::string>& values, const Places& places) {
    Condition condition{.key = key};
    for (const std::string& value : values) {
      if (value == "+") condition.kind = Condition::Kind::there;
      if (value == "-") condition.kind = Condition::Kind::absent;
    }
    for (const std::string& value : values) {
      if (value.front() != '=') continue;
      condition.kind = Condition::Kind::values;
      const std::string text = value.substr(1);
      const auto number = Json::parse(text);
      condition.values.push_back(number && text.find_first_not_of("-0123456789") == std::string::npos ? *number
                                 : text == "true" || text == "false" ? Json(text == "true")
                                                                     : Json(text));
      const auto& otherwise = places.front()->find(key)->otherwise;
      if (otherwise && otherwise->dump() == condition.values.back().dump()) condition.or_absent = true;
    }
    return condition;
  }

  // Fills in the kinds of value that none of the case's places has, from other places with the same path.
  void fill(const std::string& key, const std::string& path, KeyCase& as) const {
    const auto same = by_path_.find(path);
    if (as.standing == Standing::refused || same == by_path_.end()) return;
    int ignored = 0;
    if (as.value.empty()) as.value = value_of(key, same->second, ignored);
    for (Alternative& a : as.value) {
      if (a.kind != Alternative::Kind::list || !a.element.empty()) continue;
      a.element = value_of("", children_of(same->second, key, true), ignored);
    }
  }

  static void require_choices(const std::string& decider, const Places& places) {
    std::set<std::string> open, made;
    for (const Place* place : places) {
      const KeyFacts& facts = *place->find(decider);
      for (const YamlFact& fact : facts.facts) open.insert(fact.choices.begin(), fact.choices.end());
      made.insert(decision(*place, facts)->substr(1));
    }
    for (const std::string& choice : open) {
      if (!made.contains(choice)) throw incomplete(places.front()->path, decider, "never choose " + choice);
    }
  }

  void note_paths(const Place& place) {
    by_path_[place.path].push_back(&place);
    for (const Place* child : place.children) note_paths(*child);
  }

  const Specimens& specimens_;
  std::map<std::string, Places> by_path_;
};

void require_complete(const MapModel& model) {
  for (const KeyModel& key : model.keys) {
    if (key.meaning.empty() && !model.names && !is_refused(key)) {
      throw incomplete(model.path, key.name, "don't say what this key means");
    }
    for (const KeyCase& one : key.cases) {
      if (one.standing == Standing::refused) continue;
      if (one.value.empty()) throw incomplete(model.path, key.name, "don't have this key");
      for (const Alternative& a : one.value) {
        if (a.map != nullptr) require_complete(*a.map);
        if (a.kind == Alternative::Kind::list && a.element.empty()) {
          throw incomplete(model.path, key.name, "have no element in this list");
        }
        for (const Alternative& element : a.element) {
          if (element.map != nullptr) require_complete(*element.map);
        }
      }
    }
  }
}

}  // namespace

std::string unit_of(const KeyModel& key) {
  using Kind = Alternative::Kind;
  for (const KeyCase& one : key.cases) {
    for (const Alternative& a : one.value) {
      const bool numeric = a.kind == Kind::number || a.kind == Kind::integer || a.kind == Kind::numbers;
      const bool of_numbers = a.kind == Kind::list && has(a.element, Kind::numbers);
      if (numeric || of_numbers) return description::unit_of_key(key.name);
    }
  }
  return {};
}

bool is_refused(const KeyModel& key) noexcept {
  return std::all_of(key.cases.begin(), key.cases.end(),
                     [](const KeyCase& one) { return one.standing == Standing::refused; });
}

MapModel model_of(const Specimens& specimens) {
  int contradictions = 0;
  MapModel model = Builder(specimens).build(specimens.roots(), contradictions);
  share_keys(model, specimens);
  require_complete(model);
  return model;
}

}  // namespace proxarm::command_line
