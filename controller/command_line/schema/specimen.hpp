// Reads specimens: files that together have every key of a kind of file, each with its meaning as a comment. The
// program's own readers read them while a journal records their questions (yaml_journal.hpp). The answers are kept
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

// What a reader asked about one key in one place. A list's element is a key without a name.
struct KeyFacts {
  std::string key;
  Standing standing = Standing::optional;
  bool is_told = false;  // whether the standing is known; the first question that tells it counts
  std::vector<description::YamlFact> facts{};
  std::optional<description::Json> otherwise{};
};

// A map or a list of a specimen.
struct Place {
  std::string path;  // without indices: drives[].simulation
  std::string key;   // in the place that holds it; empty for an element of a list
  bool is_list = false;
  std::vector<KeyFacts> asked{};               // in the order of the first question
  std::map<std::string, std::string> there{};  // what the file has here; text of scalars
  std::vector<const Place*> children{};
  std::optional<std::string> names{};  // keys are names that match this pattern (empty: any)
  std::vector<std::string> exactly_one{};

  [[nodiscard]] const KeyFacts* find(const std::string& name) const;
};

class Specimens {
 public:
  // Reads all specimens of a kind (cell, hand, scene, sensor, drive), from the folder of that name below `folder`.
  Specimens(const std::filesystem::path& folder, const std::string& kind);

  [[nodiscard]] const std::vector<const Place*>& roots() const noexcept { return roots_; }
  // Returns the comment of the key with this path, else of the first key whose path agrees in the most names, counted
  // from its end. Empty if there is none.
  [[nodiscard]] std::string meaning(const std::string& path, const std::string& key) const;
  // Returns the keys on which this key depends: its comment may begin with "(by KEY, KEY)".
  [[nodiscard]] std::vector<std::string> deciders(const std::string& path, const std::string& key) const;
  // Returns PATH if the key's comment begins with "(of PATH)": the key is a map of defaults for all maps there. Empty
  // otherwise.
  [[nodiscard]] std::string shared_by(const std::string& path, const std::string& key) const;

 private:
  void read(const std::filesystem::path& file, const std::string& kind);
  [[nodiscard]] std::string comment(const std::string& path, const std::string& key) const;

  std::vector<std::unique_ptr<Place>> places_;
  std::vector<const Place*> roots_;
  std::vector<std::pair<std::string, std::string>> meanings_;  // by paths, in the order of the files and their lines
};

}  // namespace proxarm::command_line
