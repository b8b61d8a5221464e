// Specimens: files that together have every key that a kind of file can have, each with its meaning as a comment behind
// it. They are read by the program's own readers while a journal listens (yaml_journal.hpp); what is heard is kept
// here, place by place.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "models/files/yaml_journal.hpp"

namespace proxarm::command_line {

enum class Standing : std::uint8_t { optional, required, refused };

// What was asked of one key in one place. An element of a list counts as a key without a name.
struct KeyFacts {
  std::string key;
  Standing standing = Standing::optional;
  bool is_told = false;  // its standing, by the first question that says it
  std::vector<description::YamlFact> facts{};
  std::optional<description::Json> otherwise{};
};

// A map or a list of a specimen.
struct Place {
  std::string path;  // without indices: drives[].simulation
  std::string key;   // in the place that holds it; empty for an element of a list
  bool is_list = false;
  std::vector<KeyFacts> asked{};               // in the order of the first question
  std::map<std::string, std::string> there{};  // what the file has here; of scalars their text
  std::vector<const Place*> children{};
  std::optional<std::string> names{};  // keys are names, which fit this pattern (empty: any)
  std::vector<std::string> exactly_one{};

  [[nodiscard]] const KeyFacts* find(const std::string& name) const;
};

class Specimens {
 public:
  // Reads all specimens of a kind (cell, hand, scene, sensor, drive), in the folder of its name below `folder`.
  Specimens(const std::filesystem::path& folder, const std::string& kind);

  [[nodiscard]] const std::vector<const Place*>& roots() const noexcept { return roots_; }
  // The comment behind that key: behind the key of this path, else of the path whose end is alike the furthest, the
  // first of those. Empty if there is none.
  [[nodiscard]] std::string meaning(const std::string& path, const std::string& key) const;
  // A comment may begin with "(by KEY, KEY)": what is asked of its key differs by what those beside it say.
  [[nodiscard]] std::vector<std::string> deciders(const std::string& path, const std::string& key) const;
  // A comment may begin with "(of PATH)": its key is a map of keys that all maps there have from it. That path, or
  // none.
  [[nodiscard]] std::string shared_by(const std::string& path, const std::string& key) const;

 private:
  void read(const std::filesystem::path& file, const std::string& kind);
  [[nodiscard]] std::string comment(const std::string& path, const std::string& key) const;

  std::vector<std::unique_ptr<Place>> places_;
  std::vector<const Place*> roots_;
  std::vector<std::pair<std::string, std::string>> meanings_;  // by paths, in the order of the files and their lines
};

}  // namespace proxarm::command_line
