// Defines the tree behind YamlNode. Only yaml_file.cpp and yaml_tree.cpp include it.
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
  std::string text;                                        // text of a scalar
  std::string key;                                         // key in the parent, if the parent is a map
  std::size_t index = 0;                                   // index in the parent, if the parent is a list
  int line = 0, column = 0, key_line = 0, key_column = 0;  // counted from 1
  const Item* parent = nullptr;
  // If a reader sets defaults for a map that doesn't exist, an empty map is added.
  mutable std::vector<Item*> children;
  mutable const Item* defaults = nullptr;  // a map that supplies the keys that this map doesn't have
  mutable std::vector<std::string> asked;  // the keys that a reader has asked for

  // Returns the key that names this value: its own key or, for list elements, the key of the list.
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

  // Returns the line of a key in this map itself, without defaults; 0 if the key is missing.
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
  mutable std::deque<Item> items;  // items have stable addresses; the first item is the root
};

// Returns why `text` isn't a number, if this isn't obvious.
std::string number_advice(std::string_view text);

}  // namespace proxarm::description
