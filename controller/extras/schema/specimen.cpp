#include "controller/extras/schema/specimen.hpp"

#include <algorithm>
#include <fstream>
#include <regex>
#include <sstream>

#include "models/base/setup_error.hpp"
#include "models/description/cell.hpp"
#include "models/description/hand.hpp"
#include "models/description/modbus_drive.hpp"
#include "models/description/sensor.hpp"
#include "scenes/format/scene_file.hpp"
#include "scenes/format/tool_file.hpp"

namespace proxarm::command_line {
namespace {

namespace fs = std::filesystem;
using description::YamlFact;
using description::YamlNode;

// Returns the path without indices: drives[2].range_rad becomes drives[].range_rad.
std::string without_indices(const std::string& path) {
  std::string text;
  bool inside = false;
  for (const char c : path) {
    if (c == ']') inside = false;
    if (!inside) text += c;
    if (c == '[') inside = true;
  }
  return text;
}

std::string joined(const std::string& path, const std::string& key) { return path.empty() ? key : path + "." + key; }

// A specimen's maps and lists by their paths, and its comments. It is read without a journal.
struct Content {
  std::vector<std::string> lines{};
  std::map<std::string, Place> places{};
  std::vector<std::pair<std::string, std::string>> meanings{};  // paths of keys without indices, and the keys' comments

  explicit Content(const fs::path& file) {
    std::ifstream in(file);
    for (std::string line; std::getline(in, line);) lines.push_back(line);
    walk(YamlNode::load(file));
  }

  void walk(const YamlNode& node) {
    Place& place = places[node.path()];
    place.path = without_indices(node.path());
    place.key = node.name();
    place.is_list = node.is_list();
    if (node.is_list()) {
      for (const YamlNode& element : node.as_list()) {
        if (!element.is_scalar()) walk(element);
      }
      return;
    }
    for (const std::string& key : node.keys()) {
      const YamlNode value = node.at(key);
      place.there[key] = value.is_scalar() ? value.as_string() : "";
      note_meaning(joined(place.path, key), key, value.line());
      if (!value.is_scalar()) walk(value);
    }
  }

  // Notes the comment of a key whose value begins in line `line`; the key may be in a line above. A line's comment
  // belongs to the first key in that line.
  void note_meaning(const std::string& path, const std::string& key, int line) {
    static const std::regex parts(R"re(^[-\s{]*"?([^\s:"]+)"?:.*?\s#\s(.*)$)re"),
        plain(R"re(^[-\s{]*"?([^\s:"]+)"?:.*$)re");
    for (int i = line; i > 0; --i) {
      const std::string& text = lines[static_cast<std::size_t>(i - 1)];
      std::smatch found;
      if (!std::regex_match(text, found, plain) || found[1] != key) {
        // The line begins with another key, so its comment isn't this key's.
        if (text.find(key + ":") != std::string::npos) return;
        continue;
      }
      if (std::regex_match(text, found, parts)) meanings.emplace_back(path, found[2]);
      return;
    }
  }
};

class Listener final : public description::YamlJournal {
 public:
  Listener(const Content& content, std::vector<std::unique_ptr<Place>>& places) : content_(content), places_(places) {}

  void note(const YamlNode& parent, std::string_view key, const YamlFact& fact) override {
    Place& place = place_of(parent.path());
    if (fact.kind == YamlFact::Kind::names)
      place.names = fact.pattern.empty() ? place.names.value_or("") : fact.pattern;
    if (fact.kind == YamlFact::Kind::exactly_one) place.exactly_one = fact.choices;
    if (fact.kind == YamlFact::Kind::names || fact.kind == YamlFact::Kind::exactly_one) return;
    auto facts = std::find_if(place.asked.begin(), place.asked.end(), [&](const auto& k) { return k.key == key; });
    if (facts == place.asked.end()) {
      place.asked.push_back({.key = std::string(key)});
      facts = place.asked.end() - 1;
    }
    // A key is required if the reader takes its value without first asking whether the key is there.
    const bool must = fact.kind == YamlFact::Kind::required;
    if (!facts->is_told && must) facts->standing = Standing::required;
    facts->is_told = facts->is_told || must || fact.kind == YamlFact::Kind::asked;
    if (fact.kind == YamlFact::Kind::needed) facts->standing = Standing::required;
    if (fact.kind == YamlFact::Kind::refused) facts->standing = Standing::refused;
    if (fact.kind == YamlFact::Kind::otherwise && fact.otherwise.dump() != "null") facts->otherwise = fact.otherwise;
    facts->facts.push_back(fact);
  }

  Place* root() { return &place_of(""); }

 private:
  Place& place_of(const std::string& path) {
    const auto known = here_.find(path);
    if (known != here_.end()) return *known->second;
    places_.push_back(std::make_unique<Place>(content_.places.at(path)));
    Place& place = *places_.back();
    here_[path] = &place;
    if (path.empty()) return place;
    const std::size_t end = path.back() == ']' ? path.rfind('[') : path.rfind('.');
    place_of(end == std::string::npos ? "" : path.substr(0, end)).children.push_back(&place);
    return place;
  }

  const Content& content_;
  std::vector<std::unique_ptr<Place>>& places_;
  std::map<std::string, Place*> here_;
};

void read_as(const fs::path& file, const std::string& kind) {
  if (kind == "cell") description::load_cell(file);
  if (kind == "hand") description::load_hand(file);
  if (kind == "scene") scenes::load_scene(file);
  if (kind == "tool") scenes::load_tool(file);
  if (kind == "sensor") description::load_sensor(file);
  if (kind == "drive") description::load_modbus_drive(file);
}

}  // namespace

const KeyFacts* Place::find(const std::string& name) const {
  const auto found = std::find_if(asked.begin(), asked.end(), [&](const KeyFacts& k) { return k.key == name; });
  return found == asked.end() ? nullptr : &*found;
}

Specimens::Specimens(const fs::path& folder, const std::string& kind) {
  std::vector<fs::path> files;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder / kind, error)) {
    if (entry.path().extension() == ".yaml") files.push_back(entry.path());
  }
  if (files.empty()) {
    throw description::SetupError({.file = (folder / kind).string(), .found = "no specimens", .expected = "*.yaml"});
  }
  std::sort(files.begin(), files.end());
  for (const fs::path& file : files) read(file, kind);
}

void Specimens::read(const fs::path& file, const std::string& kind) {
  const Content content(file);
  for (const auto& [path, meaning] : content.meanings) {
    for (const auto& [known, said] : meanings_) {
      if (known != path) continue;
      throw description::SetupError({.file = file.string(), .key = path, .message = "has a second meaning"});
    }
    meanings_.emplace_back(path, meaning);
  }
  Listener listener(content, places_);
  {
    const description::YamlListening listening(listener);
    read_as(file, kind);
  }
  roots_.push_back(listener.root());
}

std::string Specimens::comment(const std::string& path, const std::string& key) const {
  const std::string wanted = joined(path, key);
  const auto alike = [&](const std::string& other) {
    const auto [mine, theirs] = std::mismatch(wanted.rbegin(), wanted.rend(), other.rbegin(), other.rend());
    const std::string end(wanted.rbegin(), mine);  // the names that agree, backwards
    if (mine == wanted.rend() && theirs == other.rend()) return std::size_t{1000};
    return static_cast<std::size_t>(std::count(end.begin(), end.end(), '.')) +
           (mine == wanted.rend() || theirs == other.rend() ? 1U : 0U);
  };
  std::string best;
  std::size_t most = 0;
  for (const auto& [other, meaning] : meanings_) {
    if (alike(other) <= most) continue;
    most = alike(other);
    best = meaning;
  }
  return best;
}

std::string Specimens::meaning(const std::string& path, const std::string& key) const {
  const std::string text = comment(path, key);
  return text.starts_with("(by ") || text.starts_with("(of ") ? text.substr(text.find(") ") + 2) : text;
}

std::string Specimens::shared_by(const std::string& path, const std::string& key) const {
  const std::string text = comment(path, key);
  return text.starts_with("(of ") ? text.substr(4, text.find(") ") - 4) : "";
}

std::vector<std::string> Specimens::deciders(const std::string& path, const std::string& key) const {
  const std::string text = comment(path, key);
  std::vector<std::string> keys;
  if (!text.starts_with("(by ")) return keys;
  std::istringstream words(text.substr(4, text.find(") ") - 4));
  for (std::string word; words >> word;) keys.push_back(word.back() == ',' ? word.substr(0, word.size() - 1) : word);
  return keys;
}

}  // namespace proxarm::command_line
