#include "models/files/ini_file.hpp"

#include <algorithm>

#include "models/base/text.hpp"

namespace proxarm::description {
namespace {

constexpr std::size_t most_bytes = 4'000'000;
constexpr std::string_view byte_order_mark = "\xEF\xBB\xBF", blanks = " \t\r";

std::string lower(std::string_view text) {
  std::string small(text);
  std::transform(small.begin(), small.end(), small.begin(),
                 [](unsigned char c) { return static_cast<char>(c >= 'A' && c <= 'Z' ? c + ('a' - 'A') : c); });
  return small;
}

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(blanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(blanks) - first + 1);
}

std::optional<std::int64_t> parse(std::string_view value) {
  const bool negative = value[0] == '-';
  const std::string digits = lower(value.substr(negative || value[0] == '+' ? 1 : 0));
  const bool hex = digits.rfind("0x", 0) == 0;
  const std::string rest = hex ? digits.substr(2) : digits;
  const char* known = hex ? "0123456789abcdef" : "0123456789";
  if (rest.empty() || rest.size() > (hex ? 15 : 16) || rest.find_first_not_of(known) != std::string::npos) {
    return std::nullopt;
  }
  const bool octal = !hex && rest.size() > 1 && rest[0] == '0';
  if (octal && rest.find_first_of("89") != std::string::npos) return std::nullopt;
  const std::int64_t size = std::stoll(rest, nullptr, hex ? 16 : octal ? 8 : 10);
  return negative ? -size : size;
}

// Removes control characters from a name in a foreign file, because a terminal would obey them.
std::string printable(std::string_view name) {
  const std::string quoted = in_quotes(name.substr(0, 80));
  return quoted.substr(1, quoted.size() - 2);
}

void note_mistake(IniFile::Section& section, std::string mistake, int line) {
  if (!section.mistake.empty()) return;
  section.mistake = std::move(mistake);
  section.mistake_line = line;
}

void read_value(IniFile::Section& section, std::string_view entry, int line) {
  const std::size_t equals = entry.find('=');
  if (equals == std::string_view::npos) {
    return note_mistake(section, "found " + in_quotes(entry.substr(0, 80)) + ", expected KEY=VALUE", line);
  }
  const std::string key = lower(trimmed(entry.substr(0, equals)));
  const std::string value(trimmed(entry.substr(equals + 1)));
  const auto [found, is_new] = section.values.emplace(key, value);
  if (is_new) {
    section.lines[key] = line;
  } else if (found->second != value) {
    note_mistake(
        section,
        printable(key) + " comes twice, here with another value than in line " + std::to_string(section.lines[key]),
        line);
  }
}

}  // namespace

IniFile::IniFile(std::string_view text, const std::filesystem::path& file) : file_(file) {
  if (text.size() > most_bytes) throw SetupError({.file = file.string(), .expected = "a file of at most 4 MB"});
  if (text.starts_with("\xFF\xFE") || text.starts_with("\xFE\xFF")) {
    throw SetupError({.file = file.string(),
                      .line = 1,
                      .found = "a text in UTF-16",
                      .expected = "one in UTF-8, ASCII or Latin-1",
                      .advice = "save it so by an editor"});
  }
  if (text.starts_with(byte_order_mark)) text.remove_prefix(byte_order_mark.size());
  Section* section = nullptr;
  for (int line = 1; !text.empty(); ++line) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view entry = trimmed(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
    if (entry.empty() || entry[0] == ';' || entry[0] == '#') continue;
    const bool begins_section = entry[0] == '[' && entry.find(']') != std::string_view::npos;
    if (begins_section) {
      section = &sections_[lower(trimmed(entry.substr(1, entry.find(']') - 1)))];
      if (section->line == 0) section->line = line;
    } else if (section == nullptr) {
      throw SetupError({.file = file.string(),
                        .line = line,
                        .found = in_quotes(entry.substr(0, 80)),
                        .expected = "a section such as [DeviceInfo]"});
    } else {
      read_value(*section, entry, line);
    }
  }
}

std::string IniFile::text(const std::string& section, const std::string& key) const {
  const auto in = sections_.find(section);
  if (in == sections_.end()) return "";
  const auto found = in->second.values.find(lower(key));
  return found == in->second.values.end() ? "" : found->second;
}

std::optional<std::int64_t> IniFile::number(const std::string& section, const std::string& key, std::int64_t low,
                                            std::int64_t high) const {
  const std::string whole = text(section, key);
  const std::string_view value = trimmed(std::string_view(whole).substr(0, whole.find(';')));
  if (value.empty() || lower(value).find("$nodeid") != std::string::npos) return std::nullopt;
  const auto parsed = parse(value);
  if (!parsed || *parsed < low || *parsed > high) {
    throw error(section, key, in_quotes(value),
                "a whole number from " + std::to_string(low) + " to " + std::to_string(high) + ", or 0x...");
  }
  return parsed;
}

SetupError IniFile::error(const std::string& section, const std::string& key, std::string found,
                          std::string expected) const {
  int line = line_of(section);
  if (const auto in = sections_.find(section); in != sections_.end()) {
    if (const auto at = in->second.lines.find(lower(key)); at != in->second.lines.end()) line = at->second;
  }
  return SetupError({.file = file_.string(),
                     .line = line,
                     .key = "[" + printable(section) + "] " + printable(key),
                     .found = std::move(found),
                     .expected = std::move(expected)});
}

int IniFile::line_of(const std::string& section) const {
  const auto found = sections_.find(section);
  return found == sections_.end() ? 0 : found->second.line;
}

}  // namespace proxarm::description
