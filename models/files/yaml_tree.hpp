// The tree behind YamlNode; only yaml_file.cpp and yaml_tree.cpp include it.
#pragma once

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
  Item* parent = nullptr;
  std::vector<Item*> children;
  mutable std::vector<std::string> asked;  // keys that a reader has asked for

  // The key that names this value: its own, or for elements of lists that of the list.
  [[nodiscard]] std::string_view named() const noexcept {
    const Item* item = this;
    while (item->key.empty() && item->parent != nullptr) item = item->parent;
    return item->key;
  }

  void heard(const std::shared_ptr<const Document>& document, const YamlFact& fact) const;
};

struct YamlNode::Document {
  std::filesystem::path file;
  std::filesystem::path folder;  // absolute
  std::deque<Item> items;        // stable addresses; the first is the root
};

// Why `text` is no number, where that isn't obvious.
std::string number_advice(std::string_view text);

}  // namespace proxarm::description
