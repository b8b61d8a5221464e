// Reads specimens: files that together have every key of a kind of file, each key with its meaning as a comment. The
// program's own readers read the specimens while a journal records the readers' questions (yaml_journal.hpp). A
// Specimens object keeps what the questions tell, for each map and each list.
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

// What a reader asked about one key in one place. An element of a list is a key without a name.
struct KeyFacts {
  std::string key;
  Standing standing = Standing::optional;
  bool is_told = false;  // whether a question has told the standing; the first such question counts
  std::vector<description::YamlFact> facts{};
  std::optional<description::Json> otherwise{};
};

// A map or a list of a specimen.
struct Place {
  std::string path;  // without indices: drives[].simulation
  std::string key;   // key of this place in the place that contains it; empty for an element of a list
  bool is_list = false;
  std::vector<KeyFacts> asked{};               // one for each key, in the order of the reader's first questions
  std::map<std::string, std::string> there{};  // the file's keys here, with the text of scalars
  std::vector<const Place*> children{};
  // If the keys are names of the user's choice: the pattern that the names match; an empty pattern matches any name.
  std::optional<std::string> names{};
  std::vector<std::string> exactly_one{};

  [[nodiscard]] const KeyFacts* find(const std::string& name) const;
};

class Specimens {
 public:
  // Reads all specimens of a kind of file (cell, hand, scene, sensor, drive) from the folder FOLDER/KIND.
  Specimens(const std::filesystem::path& folder, const std::string& kind);

  [[nodiscard]] const std::vector<const Place*>& roots() const noexcept { return roots_; }
  // Returns the comment of the key with this path. If there is none, returns the comment of the key whose path agrees
  // with this path in the most names, counted from the end; of several such keys, of the first. Returns an empty text
  // if no key's path agrees.
  [[nodiscard]] std::string meaning(const std::string& path, const std::string& key) const;
  // Returns the keys on which this key depends. The comment of such a key begins with "(by KEY, KEY)".
  [[nodiscard]] std::vector<std::string> deciders(const std::string& path, const std::string& key) const;
  // Returns PATH if the key's comment begins with "(of PATH)", which means that the key is a map of defaults for all
  // maps at PATH. Otherwise returns an empty text.
  [[nodiscard]] std::string shared_by(const std::string& path, const std::string& key) const;

 private:
  void read(const std::filesystem::path& file, const std::string& kind);
  [[nodiscard]] std::string comment(const std::string& path, const std::string& key) const;

  std::vector<std::unique_ptr<Place>> places_;
  std::vector<const Place*> roots_;
  // Paths and comments of keys, in the order of the files and lines.
  std::vector<std::pair<std::string, std::string>> meanings_;
};

}  // namespace proxarm::command_line
