#include "models/files/yaml_insertion.hpp"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <optional>

namespace proxarm::description {
namespace {

// Returns the place of a line's first character. Lines are counted from 0; after the last line, the place is the size
// of the text.
std::size_t line_begin(const std::string& text, int line) {
  std::size_t at = 0;
  for (int i = 0; i < line && at < text.size(); ++i) at = std::min(text.find('\n', at), text.size() - 1) + 1;
  return at;
}

YAML::Node member_of(const YAML::Node& list, const YamlStep& step) {
  for (const YAML::Node& member : list) {
    if (member.IsMap() && member[step.key] && member[step.key].IsScalar() && member[step.key].Scalar() == step.is)
      return member;
  }
  return YAML::Node(YAML::NodeType::Undefined);
}

std::optional<YAML::Node> map_at(const std::string& text, const std::vector<YamlStep>& path) {
  YAML::Node node = YAML::Load(text);
  for (const YamlStep& step : path) {
    YAML::Node next(YAML::NodeType::Undefined);
    if (step.is.empty() && node.IsMap() && node[step.key]) next = node[step.key];
    if (!step.is.empty() && node.IsSequence()) next = member_of(node, step);
    if (!next.IsDefined()) return std::nullopt;
    node.reset(next);
  }
  return node.IsMap() ? std::optional(node) : std::nullopt;
}

// Returns the mark of the last key that has a plain value on its line.
std::optional<YAML::Mark> last_line(const YAML::Node& map) {
  std::optional<YAML::Mark> last;
  for (const auto& entry : map) {
    if (!entry.second.IsScalar() || entry.second.Mark().line != entry.first.Mark().line) continue;
    if (!last || entry.first.Mark().line > last->line) last = entry.first.Mark();
  }
  return last;
}

std::size_t place_of(const std::string& text, const YAML::Mark& mark) {
  return std::min(line_begin(text, mark.line) + static_cast<std::size_t>(mark.column), text.size());
}

// Inserts an entry after the first key. The first key must stay first, because people and programs recognise a list's
// member by it.
bool insert_in_braces(std::string& text, const YAML::Node& map, const std::string& entry) {
  const std::size_t begin = place_of(text, map.Mark());
  if (begin >= text.size() || text[begin] != '{') return false;
  if (map.size() == 0) {
    text.insert(begin + 1, entry);
    return true;
  }
  if (map.size() > 1) {
    const std::size_t second = place_of(text, std::next(map.begin())->first.Mark());
    text.insert(second, entry + ", ");
    return true;
  }
  const YAML::Node only = map.begin()->second;
  if (!only.IsScalar()) return false;
  const std::size_t end = text.find('}', place_of(text, only.Mark()) + only.Scalar().size());
  if (end == std::string::npos) return false;
  text.insert(end, ", " + entry);
  return true;
}

}  // namespace

bool has_key(const std::string& text, const std::vector<YamlStep>& path, const std::string& key) {
  const std::optional<YAML::Node> map = map_at(text, path);
  return map && (*map)[key];
}

bool insert_key(std::string& text, const std::vector<YamlStep>& path, const std::string& key,
                const std::string& value) {
  const std::optional<YAML::Node> map = map_at(text, path);
  if (!map || (*map)[key]) return false;
  const std::string entry = key + ": " + value;
  if (map->Style() == YAML::EmitterStyle::Flow) {
    return insert_in_braces(text, *map, entry);
  }
  const std::optional<YAML::Mark> last = last_line(*map);
  if (!last) return false;
  const std::size_t begin = line_begin(text, last->line), next = line_begin(text, last->line + 1);
  const bool whole = next > begin && text[next - 1] == '\n';
  // If the file's lines end in two characters ("\r\n"), the new line does too.
  const std::string end = whole && next - begin > 1 && text[next - 2] == '\r' ? "\r\n" : "\n";
  text.insert(
      next, (whole ? "" : end) + std::string(static_cast<std::size_t>(last->column), ' ') + entry + (whole ? end : ""));
  return true;
}

}  // namespace proxarm::description
