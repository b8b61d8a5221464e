// The tree behind YamlNode; only yaml_file.cpp and yaml_tree.cpp include it.
#pragma once

#include <algorithm>
#include <deque>
#include <memory>
#include <string>
#include <vector>

#include "models/files/yaml_file.hpp"
#include "models/files/yaml_journal.hpp"

namespace proxarm::description {

struct YamlNode::Item {
  enum class Kind { null, scalar, list, map };

  Kind kind = Kind::null;
  bool is_quoted = false;
  std::string text;                                        // of a scalar
  std::string key;                                         // in the parent's map
  std::size_t index = 0;                                   // in the parent's list
  int line = 0, column = 0, key_line = 0, key_column = 0;  // from 1
  const Item* parent = nullptr;
  mutable std::vector<Item*> children;     // an empty map is added if a reader sets defaults for it
  mutable const Item* defaults = nullptr;  // a map that supplies missing keys
  mutable std::vector<std::string> asked;  // keys that a reader has asked for

  // The key that names this value: its key, or for list elements the list's key.
  [[nodiscard]] std::string_view named() const noexcept {
    const Item* item = this;
    while (item->key.empty() && item->parent != nullptr) item = item->parent;
    return item->key;
  }

  [[nodiscard]] const Item* own(std::string_view wanted) const noexcept {
    for (const Item* item : children) {
      if (item->key == wanted) return item;
    }
    return nullptr;
  }

  [[nodiscard]] bool is_asked(std::string_view wanted) const {
    return std::find(asked.begin(), asked.end(), wanted) != asked.end();
  }

  [[nodiscard]] const Item* map_with(std::string_view wanted) const;

  // The line of a key in this map itself; 0: missing.
  [[nodiscard]] int line_of(std::string_view wanted) const noexcept {
    const Item* item = own(wanted);
    return item != nullptr ? item->key_line : 0;
  }

  void default_to(const Item& other) const;
  void heard(const std::shared_ptr<const Document>& document, const YamlFact& fact) const;
};

struct YamlNode::Document {
  std::filesystem::path file;
  std::filesystem::path folder;    // absolute
  mutable std::deque<Item> items;  // stable addresses; the first is the root
};

// Why `text` isn't a number, if that isn't obvious.
std::string number_advice(std::string_view text);

}  // namespace proxarm::description
