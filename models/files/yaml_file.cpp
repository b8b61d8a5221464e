#include "models/files/yaml_file.hpp"

#include <algorithm>
#include <cmath>
#include <deque>
#include <fstream>
#include <iterator>
#include <sstream>
#include <utility>

#include "models/base/text.hpp"
#include "models/files/yaml_journal.hpp"
#include "models/files/yaml_tree.hpp"

namespace proxarm::description {
namespace {

struct Unit {
  std::string_view suffix, unit;
};

// Longer suffixes come first, because the first suffix that matches is used.
constexpr Unit units[] = {
    {"_Nms_per_rad", "Nms/rad"},
    {"_m_per_s2", "m/s²"},
    {"_rad_per_s2", "rad/s²"},
    {"_Nm_per_rad", "Nm/rad"},
    {"_rad_per_s", "rad/s"},
    {"_counts_per_Nm", "1/Nm"},
    {"_counts_per_N", "1/N"},
    {"counts_per_Nm", "1/Nm"},
    {"counts_per_N", "1/N"},
    {"_Ns_per_m", "Ns/m"},
    {"_N_per_mm", "N/mm"},
    {"_N_per_m", "N/m"},
    {"_m_per_s", "m/s"},
    {"_kg_m2", "kg m²"},
    {"_per_s", "1/s"},
    {"_per_m", "1/m"},
    {"_counts", "counts"},
    {"_Nms", "Nms"},
    {"_rad", "rad"},
    {"_deg", "°"},
    {"_kg", "kg"},
    {"_Hz", "Hz"},
    {"_Nm", "Nm"},
    {"_mm", "mm"},
    {"_ms", "ms"},
    {"_us", "µs"},
    {"_N", "N"},
    {"_J", "J"},
    {"_W", "W"},
    {"_m", "m"},
    {"_s", "s"},
};

std::string with_unit(std::string_view key) {
  if (key == "bitrate" || key == "data_bitrate") return " bit/s";
  const std::string unit = unit_of_key(key);
  return unit.empty() ? " (no unit)" : " " + unit;
}

std::string range_text(Range r, std::string_view key, std::string_view noun) {
  const bool low = r.min > std::numeric_limits<double>::lowest(), high = r.max < std::numeric_limits<double>::max();
  std::string text(noun);
  if (low && high && !r.above_min) {
    text += " from " + number_text(r.min) + " to " + number_text(r.max);
  } else {
    if (low) text += (r.above_min ? " above " : " of at least ") + number_text(r.min);
    if (high) text += std::string(low ? " and" : " of") + " at most " + number_text(r.max);
  }
  const std::string unit = with_unit(key);
  return text + (!low && !high && unit != " (no unit)" ? " in" + unit : unit);
}

std::string integer_text(std::int64_t min, std::int64_t max, std::string_view key) {
  const std::string unit = with_unit(key);
  return "a whole number from " + std::to_string(min) + " to " + std::to_string(max) +
         (unit == " (no unit)" ? "" : unit);
}

std::string size_text(std::size_t min, std::size_t max, std::string_view noun) {
  if (min == max) return "a list of " + std::to_string(min) + " " + std::string(noun);
  std::string text = "a list of at least " + std::to_string(min) + " " + std::string(noun);
  if (max != std::numeric_limits<std::size_t>::max()) {
    text = "a list of " + std::to_string(min) + " to " + std::to_string(max) + " " + std::string(noun);
  }
  return text;
}

std::vector<std::string> to_vector(std::initializer_list<std::string> words) { return words; }

using Note = YamlFact::Kind;  // the kinds of facts for a journal

Range whole(std::int64_t min, std::int64_t max) { return between(static_cast<double>(min), static_cast<double>(max)); }

void note_default(const YamlNode& node, std::string_view key, const YamlFact& fact, const Json& otherwise) {
  note(node, key, {.kind = Note::otherwise, .otherwise = otherwise});
  note(node, key, fact);
}

}  // namespace

std::string unit_of_key(std::string_view key) {
  // Only the end of a key can state a unit. If a frame is at the end (force_S), the key states no unit.
  for (const Unit& unit : units) {
    if (key.ends_with(unit.suffix)) return std::string(unit.unit);
  }
  return {};
}

// Passes a fact about this value to the journal, if there is one.
void YamlNode::Item::heard(const std::shared_ptr<const Document>& document, const YamlFact& fact) const {
  if (parent != nullptr) note(YamlNode(document, *parent), key, fact);
}

// ---- where ----------------------------------------------------------------------------------------------------------

std::string YamlNode::path() const {
  std::string text;
  for (const Item* item = item_; item != nullptr; item = item->parent) {
    if (item->parent == nullptr) break;
    const std::string part =
        item->parent->kind == Item::Kind::list ? "[" + std::to_string(item->index) + "]" : item->key;
    const bool dot = !text.empty() && text.front() != '[';
    text = part + (dot ? "." : "") + text;
  }
  return text;
}

int YamlNode::line() const noexcept { return item_->line; }
int YamlNode::column() const noexcept { return item_->column; }
const std::filesystem::path& YamlNode::file() const noexcept { return document_->file; }
const std::string& YamlNode::name() const noexcept { return item_->key; }
bool YamlNode::is_map() const noexcept { return item_->kind == Item::Kind::map; }
bool YamlNode::is_list() const noexcept { return item_->kind == Item::Kind::list; }
bool YamlNode::is_scalar() const noexcept { return item_->kind == Item::Kind::scalar; }

std::string YamlNode::found() const {
  switch (item_->kind) {
    case Item::Kind::map:
      return "a map";
    case Item::Kind::list:
      return "a list of " + std::to_string(item_->children.size());
    case Item::Kind::null:
      return "no value";
    case Item::Kind::scalar:
      break;
  }
  // Shows numbers as they are written, and everything else in quotes.
  const bool number = !item_->is_quoted && strict_number(item_->text).has_value();
  return number && item_->text.size() < 60 ? item_->text : in_quotes(item_->text);
}

SetupError YamlNode::error(std::string expected, std::string found_text, std::string advice) const {
  return SetupError({.file = document_->file.string(),
                     .line = item_->line,
                     .column = item_->column,
                     .key = path(),
                     .found = found_text.empty() ? found() : std::move(found_text),
                     .expected = std::move(expected),
                     .advice = std::move(advice)});
}

SetupError YamlNode::error_at(std::string_view key, std::string expected, std::string found_text,
                              std::string advice) const {
  if (const Item* item = child(key)) {
    return YamlNode(document_, *item).error(std::move(expected), std::move(found_text), std::move(advice));
  }
  const std::string parent = path();
  return SetupError({.file = document_->file.string(),
                     .line = item_->line,
                     .column = item_->column,
                     .key = parent.empty() ? std::string(key) : parent + "." + std::string(key),
                     .found = found_text.empty() ? "nothing" : std::move(found_text),
                     .expected = std::move(expected),
                     .advice = std::move(advice)});
}

// ---- maps -----------------------------------------------------------------------------------------------------------

void YamlNode::require_map() const {
  if (!is_map()) throw error("a map (key: value)");
}

const YamlNode::Item* YamlNode::child(std::string_view key) const {
  if (!is_map()) return nullptr;
  if (is_heard()) note(*this, key, {.kind = Note::asked});
  const Item* found = nullptr;
  for (const Item* map = item_; map != nullptr; map = map->defaults) {
    if (!map->is_asked(key)) map->asked.emplace_back(key);
    if (found == nullptr) found = map->own(key);
  }
  return found;
}

void YamlNode::Item::default_to(const Item& other) const {
  if (kind != Kind::map || other.kind != Kind::map) return;
  defaults = &other;
  for (const Item* item : children) {
    if (const Item* same = other.own(item->key)) item->default_to(*same);
  }
}

void YamlNode::default_to(const YamlNode& other) const { item_->default_to(*other.item_); }

void YamlNode::default_to(std::string_view key, const YamlNode& other) const {
  if (!is_map()) return;
  const Item* map = item_->own(key);
  if (map == nullptr) {
    Item& empty = document_->items.emplace_back();
    empty.kind = Item::Kind::map;
    empty.key = key;
    empty.line = empty.key_line = item_->line;
    empty.column = empty.key_column = item_->column;
    empty.parent = item_;
    item_->children.push_back(&empty);
    map = &empty;
  }
  map->default_to(*other.item_);
}

SetupError YamlNode::missing(std::string_view key, std::string expected) const {
  // Names the parent's line. If a key in the parent looks like a misspelling of this key, names that key as well.
  std::string found = "nothing", advice;
  for (const Item* map = item_; map != nullptr; map = map->defaults) {
    std::vector<std::string> slips;
    for (const Item* item : map->children) {
      if (!map->is_asked(item->key)) slips.push_back(item->key);
    }
    const std::string slip = nearest(key, slips);
    const std::string where = map == item_ ? "below" : "in line " + std::to_string(map->line_of(slip));
    if (advice.empty() && !slip.empty()) advice = "is " + in_quotes(slip) + " " + where + " meant to be it?";
    if (map != item_) found += ", nor in " + YamlNode(document_, *map).path();
  }
  return error_at(key, std::move(expected), std::move(found), std::move(advice));
}

YamlNode YamlNode::required(std::string_view key, const std::string& expected) const {
  require_map();
  if (is_heard()) note(*this, key, {.kind = Note::required});
  const Item* item = child(key);
  if (item == nullptr) throw missing(key, expected);
  YamlNode node(document_, *item);
  if (item->kind == Item::Kind::null) throw node.error(expected);
  return node;
}

bool YamlNode::has(std::string_view key) const {
  require_map();
  return child(key) != nullptr;
}

YamlNode YamlNode::at(std::string_view key) const { return required(key, "a value"); }

std::optional<YamlNode> YamlNode::find(std::string_view key) const {
  if (!has(key)) return std::nullopt;
  return at(key);
}

YamlNode YamlNode::map(std::string_view key) const {
  if (is_heard()) note(*this, key, {.kind = Note::map});
  const YamlNode node = required(key, "a map (key: value)");
  node.require_map();
  return node;
}

std::optional<YamlNode> YamlNode::find_map(std::string_view key) const {
  if (is_heard()) note(*this, key, {.kind = Note::map});
  if (!has(key)) return std::nullopt;
  return map(key);
}

std::vector<YamlNode> YamlNode::list(std::string_view key, std::size_t min_size, std::size_t max_size) const {
  return required(key, size_text(min_size, max_size, "entries")).as_list(min_size, max_size);
}

std::vector<std::string> YamlNode::keys() const {
  require_map();
  std::vector<std::string> names;
  for (const Item* map = item_; map != nullptr; map = map->defaults) {
    for (const Item* item : map->children) {
      if (std::find(names.begin(), names.end(), item->key) == names.end()) names.push_back(item->key);
    }
  }
  for (const std::string& name : names) static_cast<void>(child(name));
  if (is_heard()) note(*this, {}, {.kind = Note::names});
  return names;
}

// ---- typed entries --------------------------------------------------------------------------------------------------

double YamlNode::number(std::string_view key, Range range) const {
  return required(key, range_text(range, key, "a number")).as_number(range);
}
double YamlNode::number(std::string_view key, double min, double max) const { return number(key, between(min, max)); }
double YamlNode::number_or(std::string_view key, double otherwise, Range range) const {
  if (is_heard()) note_default(*this, key, {.kind = Note::number, .range = range}, otherwise);
  return has(key) ? number(key, range) : otherwise;
}
double YamlNode::number_or(std::string_view key, double otherwise, double min, double max) const {
  return number_or(key, otherwise, between(min, max));
}

std::int64_t YamlNode::integer(std::string_view key, std::int64_t min, std::int64_t max) const {
  return required(key, integer_text(min, max, key)).as_integer(min, max);
}
std::int64_t YamlNode::integer_or(std::string_view key, std::int64_t otherwise, std::int64_t min,
                                  std::int64_t max) const {
  if (is_heard()) note_default(*this, key, {.kind = Note::integer, .range = whole(min, max)}, otherwise);
  return has(key) ? integer(key, min, max) : otherwise;
}

bool YamlNode::boolean(std::string_view key) const { return required(key, "true or false").as_boolean(); }
bool YamlNode::boolean_or(std::string_view key, bool otherwise) const {
  if (is_heard()) note_default(*this, key, {.kind = Note::boolean}, otherwise);
  return has(key) ? boolean(key) : otherwise;
}

std::string YamlNode::string(std::string_view key) const { return required(key, "a text").as_string(); }
std::string YamlNode::string_or(std::string_view key, std::string_view otherwise) const {
  if (is_heard()) note_default(*this, key, {.kind = Note::text}, otherwise);
  return has(key) ? string(key) : std::string(otherwise);
}

std::string YamlNode::choice(std::string_view key, std::span<const std::string> allowed) const {
  return required(key, one_of(allowed)).as_choice(allowed);
}
std::string YamlNode::choice(std::string_view key, std::initializer_list<std::string> allowed) const {
  return choice(key, to_vector(allowed));
}
std::string YamlNode::choice_or(std::string_view key, std::string_view otherwise,
                                std::initializer_list<std::string> allowed) const {
  if (is_heard()) note_default(*this, key, {.kind = Note::choice, .choices = allowed}, otherwise);
  return has(key) ? choice(key, allowed) : std::string(otherwise);
}

std::array<double, 3> YamlNode::vec3(std::string_view key, Range range) const {
  return required(key, size_text(3, 3, range_text(range, key, "numbers"))).as_vec3(range);
}
std::array<double, 3> YamlNode::vec3_or(std::string_view key, const std::array<double, 3>& otherwise,
                                        Range range) const {
  if (is_heard()) {
    note_default(*this, key, {.kind = Note::numbers, .range = range, .min_size = 3, .max_size = 3},
                 std::vector<double>(otherwise.begin(), otherwise.end()));
  }
  return has(key) ? vec3(key, range) : otherwise;
}
std::vector<double> YamlNode::numbers(std::string_view key, std::size_t min_size, std::size_t max_size,
                                      Range range) const {
  return required(key, size_text(min_size, max_size, range_text(range, key, "numbers")))
      .as_numbers(min_size, max_size, range);
}

std::filesystem::path YamlNode::path_of(std::string_view key) const {
  const YamlNode node = required(key, "a file's path");
  if (is_heard()) node.item_->heard(document_, {.kind = Note::path});
  const std::string text = node.as_string();
  const std::filesystem::path given(text);
  return (given.is_absolute() ? given : document_->folder / given).lexically_normal();
}

std::filesystem::path YamlNode::existing_file(std::string_view key) const {
  std::filesystem::path file = path_of(key);
  std::error_code error_code;
  const auto status = std::filesystem::status(file, error_code);
  const auto fails = [&](const std::string& why) {
    return error_at(key, "a readable file", {}, in_quotes(file.string(), 200) + " " + why);
  };
  if (!std::filesystem::exists(status)) throw fails("doesn't exist");
  if (std::filesystem::is_directory(status)) throw fails("is a folder");
  if (!std::filesystem::is_regular_file(status))
    // Reading a pipe could block forever.
    throw fails("is no file to read");
  if (!std::ifstream(file).good()) throw fails("can't be read; look at its permissions");
  return file;
}

// ---- this node ------------------------------------------------------------------------------------------------------

double YamlNode::as_number(Range range) const {
  if (is_heard()) item_->heard(document_, {.kind = Note::number, .range = range});
  const std::string expected = range_text(range, item_->named(), "a number");
  if (!is_scalar()) throw error(expected);
  if (item_->is_quoted) throw error(expected, "the text " + in_quotes(item_->text), "numbers stand without quotes");
  const std::optional<double> value = strict_number(item_->text);
  if (!value) throw error(expected, {}, number_advice(item_->text));
  if (!range.contains(*value)) throw error(expected);
  return *value;
}

std::int64_t YamlNode::as_integer(std::int64_t min, std::int64_t max) const {
  if (is_heard()) item_->heard(document_, {.kind = Note::integer, .range = whole(min, max)});
  const std::string expected = integer_text(min, max, item_->named());
  if (!is_scalar()) throw error(expected);
  if (item_->is_quoted) throw error(expected, "the text " + in_quotes(item_->text), "numbers stand without quotes");
  const std::optional<std::int64_t> value = strict_integer(item_->text);
  if (!value) throw error(expected, {}, strict_number(item_->text) ? "" : number_advice(item_->text));
  if (*value < min || *value > max) throw error(expected);
  return *value;
}

bool YamlNode::as_boolean() const {
  if (is_heard()) item_->heard(document_, {.kind = Note::boolean});
  if (is_scalar() && !item_->is_quoted) {
    if (item_->text == "true") return true;
    if (item_->text == "false") return false;
  }
  throw error("true or false");
}

std::string YamlNode::as_string() const {
  if (is_heard()) item_->heard(document_, {.kind = Note::text});
  if (!is_scalar() || item_->text.empty()) throw error("a text");
  if (item_->text.size() > 4096) throw error("a text of at most 4096 bytes");
  return item_->text;
}

std::string YamlNode::as_choice(std::span<const std::string> allowed) const {
  if (is_heard()) item_->heard(document_, {.kind = Note::choice, .choices = {allowed.begin(), allowed.end()}});
  if (!is_scalar()) throw error(one_of(allowed));
  if (std::find(allowed.begin(), allowed.end(), item_->text) != allowed.end()) return item_->text;
  const std::string meant = nearest(item_->text, allowed);
  throw error(one_of(allowed), {}, meant.empty() || allowed.size() == 1 ? "" : "did you mean " + meant + "?");
}

std::vector<YamlNode> YamlNode::as_list(std::size_t min_size, std::size_t max_size) const {
  if (is_heard()) item_->heard(document_, {.kind = Note::list, .min_size = min_size, .max_size = max_size});
  const std::size_t size = item_->children.size();
  if (!is_list() || size < min_size || size > max_size) throw error(size_text(min_size, max_size, "entries"));
  std::vector<YamlNode> nodes;
  nodes.reserve(size);
  for (const Item* item : item_->children) nodes.push_back(YamlNode(document_, *item));
  return nodes;
}

std::vector<double> YamlNode::as_numbers(std::size_t min_size, std::size_t max_size, Range range) const {
  if (is_heard()) {
    item_->heard(document_, {.kind = Note::numbers, .range = range, .min_size = min_size, .max_size = max_size});
  }
  const std::size_t size = item_->children.size();
  if (!is_list() || size < min_size || size > max_size) {
    throw error(size_text(min_size, max_size, range_text(range, item_->named(), "numbers")));
  }
  std::vector<double> values;
  values.reserve(size);
  for (const Item* item : item_->children) values.push_back(YamlNode(document_, *item).as_number(range));
  return values;
}

std::array<double, 3> YamlNode::as_vec3(Range range) const {
  const std::vector<double> values = as_numbers(3, 3, range);
  return {values[0], values[1], values[2]};
}

// Returns the map in the parent or in this map whose known keys include `wanted`, or null if no map does.
const YamlNode::Item* YamlNode::Item::map_with(std::string_view wanted) const {
  for (const Item* around : {parent, this}) {
    if (around == nullptr || around->kind != Kind::map) continue;
    for (const Item* map : around->children) {
      if (map->kind == Kind::map && map->is_asked(wanted)) return map;
    }
  }
  return nullptr;
}

SetupError YamlNode::unknown(const Item& item) const {
  const std::vector<std::string>& asked = item_->asked;
  const std::string meant = nearest(item.key, asked);
  const std::string known = asked.empty() ? "" : "known here: " + one_of(asked);
  SetupProblem problem = YamlNode(document_, item).error("a known key").problem();
  problem.line = item.key_line;
  problem.column = item.key_column;
  problem.message = "unknown key";
  problem.found.clear();
  problem.expected.clear();
  problem.advice = meant.empty() ? known : "did you mean " + in_quotes(meant) + "?";
  if (const Item* other = item_->map_with(item.key)) {
    problem.advice = "did you mean it in " + YamlNode(document_, *other).path() + "?";
  }
  return SetupError(std::move(problem));
}

void YamlNode::finish() const {
  for (const Item* item : item_->children) {
    if (is_map() && !item_->is_asked(item->key)) throw unknown(*item);
  }
  for (const Item* item : item_->children) YamlNode(document_, *item).finish();
}

}  // namespace proxarm::description
