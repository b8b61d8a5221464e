// Reads users' YAML files strictly: every mistake is reported with file, line, key, the value found and what was
// expected.
//
//   const YamlNode root = YamlNode::load("scenes/wall.yaml");
//   const double mass = root.number("mass_kg", above(0.0, 100.0));       // required; the key states the unit
//   const double friction = root.number_or("friction", 0.0, between(0.0, 10.0));
//   for (const YamlNode& object : root.list("objects", 1, 1000)) read_object(object);
//   root.finish();                                                       // reports unknown keys in the whole file
//
// The reader is stricter than YAML, because users write these files, and a silent misreading is worse than a message.
// It refuses duplicate keys, numbers with leading zeros (010), non-finite and hexadecimal reals, quoted numbers,
// anchors, aliases and tags, tabs in the indentation, several documents, text that isn't UTF-8, control characters,
// files above 16 MiB, and nesting above 32 levels. All functions throw SetupError for mistakes of the user. A node is a
// cheap handle; it keeps the data of its file in memory.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "models/base/setup_error.hpp"

namespace proxarm::description {

// The range of allowed numbers. The bounds are in the key's unit.
struct Range {
  double min = std::numeric_limits<double>::lowest();
  double max = std::numeric_limits<double>::max();
  bool above_min = false;  // whether min itself isn't allowed

  [[nodiscard]] bool contains(double value) const noexcept {
    return (above_min ? value > min : value >= min) && value <= max;
  }
};

constexpr Range between(double min, double max) { return {min, max, false}; }
constexpr Range above(double min, double max = std::numeric_limits<double>::max()) { return {min, max, true}; }
constexpr Range any_number() { return {}; }

// Returns the unit in a key's name, for messages: mass_kg → "kg", damping_Ns_per_m → "Ns/m"; empty if the name has no
// unit.
std::string unit_of_key(std::string_view key);

class YamlNode {
 public:
  // Reads a file. Messages contain `file` as it is given here. Relative paths in the file are resolved against its
  // folder.
  static YamlNode load(const std::filesystem::path& file);
  // Reads text in memory. `file` is used in messages and for relative paths.
  static YamlNode parse(std::string_view text, const std::filesystem::path& file);

  // These functions return the node's place. path() is dotted from the root, such as objects[0].friction; empty for the
  // root.
  [[nodiscard]] std::string path() const;
  [[nodiscard]] int line() const noexcept;
  [[nodiscard]] int column() const noexcept;
  [[nodiscard]] const std::filesystem::path& file() const noexcept;
  // Returns the node's key in its map; empty for list elements and the root.
  [[nodiscard]] const std::string& name() const noexcept;

  [[nodiscard]] bool is_map() const noexcept;
  [[nodiscard]] bool is_list() const noexcept;
  [[nodiscard]] bool is_scalar() const noexcept;

  // Access to a map's entries. Each call marks the key as known for finish(). If the node isn't a map, this is a
  // mistake in the file. An entry without a value (`key:`) is a mistake, too; it doesn't count as absent.
  [[nodiscard]] bool has(std::string_view key) const;
  [[nodiscard]] YamlNode at(std::string_view key) const;  // the entry is required
  [[nodiscard]] std::optional<YamlNode> find(std::string_view key) const;
  [[nodiscard]] YamlNode map(std::string_view key) const;  // the entry is required and must be a map
  [[nodiscard]] std::optional<YamlNode> find_map(std::string_view key) const;
  [[nodiscard]] std::vector<YamlNode> list(std::string_view key, std::size_t min_size = 0,
                                           std::size_t max_size = std::numeric_limits<std::size_t>::max()) const;
  // Returns the keys in the file's order, and marks all of them as known. For maps whose keys are chosen by the user.
  [[nodiscard]] std::vector<std::string> keys() const;

  [[nodiscard]] double number(std::string_view key, Range range) const;
  [[nodiscard]] double number(std::string_view key, double min, double max) const;
  [[nodiscard]] double number_or(std::string_view key, double otherwise, Range range) const;
  [[nodiscard]] double number_or(std::string_view key, double otherwise, double min, double max) const;
  [[nodiscard]] std::int64_t integer(std::string_view key, std::int64_t min, std::int64_t max) const;
  [[nodiscard]] std::int64_t integer_or(std::string_view key, std::int64_t otherwise, std::int64_t min,
                                        std::int64_t max) const;
  [[nodiscard]] bool boolean(std::string_view key) const;
  [[nodiscard]] bool boolean_or(std::string_view key, bool otherwise) const;
  [[nodiscard]] std::string string(std::string_view key) const;  // not empty
  [[nodiscard]] std::string string_or(std::string_view key, std::string_view otherwise) const;
  [[nodiscard]] std::string choice(std::string_view key, std::span<const std::string> allowed) const;
  [[nodiscard]] std::string choice(std::string_view key, std::initializer_list<std::string> allowed) const;
  [[nodiscard]] std::string choice_or(std::string_view key, std::string_view otherwise,
                                      std::initializer_list<std::string> allowed) const;
  [[nodiscard]] std::array<double, 3> vec3(std::string_view key, Range range = any_number()) const;
  [[nodiscard]] std::array<double, 3> vec3_or(std::string_view key, const std::array<double, 3>& otherwise,
                                              Range range = any_number()) const;
  [[nodiscard]] std::vector<double> numbers(std::string_view key, std::size_t min_size, std::size_t max_size,
                                            Range range = any_number()) const;
  // Returns a path as an absolute path. In the file it is absolute or relative to the file's folder. Doesn't check that
  // the path exists.
  [[nodiscard]] std::filesystem::path path_of(std::string_view key) const;
  // Returns a path as path_of() does, and checks that it is a readable file.
  [[nodiscard]] std::filesystem::path existing_file(std::string_view key) const;

  // Makes the map `defaults` supply the keys that this map doesn't have. If an entry is a map in both maps, the entry's
  // keys are supplied one by one. Errors name the place where the value is written. A key that is asked of this map
  // counts as known in `defaults`, too. Does nothing unless this node is a map. Precondition: `defaults` is in the same
  // file.
  void default_to(const YamlNode& defaults) const;
  // Does this for the map under `key`. If there is no such map, an empty map is created.
  void default_to(std::string_view key, const YamlNode& defaults) const;

  // These functions return the node's own value, for list elements.
  [[nodiscard]] double as_number(Range range = any_number()) const;
  [[nodiscard]] std::int64_t as_integer(std::int64_t min, std::int64_t max) const;
  [[nodiscard]] bool as_boolean() const;
  [[nodiscard]] std::string as_string() const;
  [[nodiscard]] std::string as_choice(std::span<const std::string> allowed) const;
  [[nodiscard]] std::array<double, 3> as_vec3(Range range = any_number()) const;
  [[nodiscard]] std::vector<double> as_numbers(std::size_t min_size, std::size_t max_size,
                                               Range range = any_number()) const;
  [[nodiscard]] std::vector<YamlNode> as_list(std::size_t min_size = 0,
                                              std::size_t max_size = std::numeric_limits<std::size_t>::max()) const;

  // Throws for the first key, in this node or below it, that no reader asked for. The message names the nearest known
  // key, or a neighbouring or inner map to which the key belongs. Call it on the root after reading.
  void finish() const;

  // Returns the error for this node, for a check by the caller. By default, `found` is the node's text.
  [[nodiscard]] SetupError error(std::string expected, std::string found = {}, std::string advice = {}) const;
  // Returns the error for an entry of this map, whether the entry is present or not.
  [[nodiscard]] SetupError error_at(std::string_view key, std::string expected, std::string found = {},
                                    std::string advice = {}) const;

 private:
  struct Item;
  struct Document;
  class Builder;

  YamlNode(std::shared_ptr<const Document> document, const Item& item) : document_(std::move(document)), item_(&item) {}
  [[nodiscard]] const Item* child(std::string_view key) const;  // null if the key is missing
  [[nodiscard]] std::string found() const;
  [[nodiscard]] SetupError unknown(const Item& item) const;
  [[nodiscard]] SetupError missing(std::string_view key, std::string expected) const;
  [[nodiscard]] YamlNode required(std::string_view key, const std::string& expected) const;
  void require_map() const;

  std::shared_ptr<const Document> document_;
  const Item* item_;
};

}  // namespace proxarm::description
