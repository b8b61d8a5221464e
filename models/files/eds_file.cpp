#include "models/files/eds_file.hpp"

#include <algorithm>
#include <boost/property_tree/ini_parser.hpp>
#include <fstream>
#include <sstream>

#include "models/base/setup_error.hpp"
#include "models/base/text.hpp"
#include "models/files/eds_bitrates.hpp"

namespace proxarm::description {
namespace {

using boost::property_tree::ptree;

constexpr std::size_t most_bytes = 4'000'000;
constexpr int most_sub_indices = 254;

std::string lower(std::string_view text) {
  std::string small(text);
  std::transform(small.begin(), small.end(), small.begin(),
                 [](unsigned char c) { return static_cast<char>(c >= 'A' && c <= 'Z' ? c + ('a' - 'A') : c); });
  return small;
}

std::string trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t\r");
  if (first == std::string_view::npos) return "";
  return std::string(text.substr(first, text.find_last_not_of(" \t\r") - first + 1));
}

// Bits of a data type by its number in CiA 301, table 44.
int bits_of_type(std::int64_t type) noexcept {
  constexpr std::pair<int, int> types[] = {{0x01, 1},  {0x02, 8},  {0x03, 16}, {0x04, 32}, {0x05, 8},
                                           {0x06, 16}, {0x07, 32}, {0x08, 32}, {0x10, 24}, {0x11, 64},
                                           {0x12, 40}, {0x13, 48}, {0x14, 56}, {0x15, 64}, {0x16, 24},
                                           {0x18, 40}, {0x19, 48}, {0x1A, 56}, {0x1B, 64}};
  for (const auto& [number, bits] : types) {
    if (number == type) return bits;
  }
  return 0;
}

// The INI with its keys in lower case, and the line of each key, since Boost's parser doesn't keep lines.
class Ini {
 public:
  Ini(std::string_view text, const std::filesystem::path& file) : file_(file) {
    if (text.size() > most_bytes) throw SetupError({.file = file.string(), .expected = "a file of at most 4 MB"});
    note_lines(text);
    try {
      std::istringstream in{std::string(text)};
      ptree tree;
      boost::property_tree::read_ini(in, tree);
      for (const auto& [section, keys] : tree) {
        auto& into = sections_[lower(trimmed(section))];
        for (const auto& [key, value] : keys) into[lower(trimmed(key))] = trimmed(value.data());
      }
    } catch (const boost::property_tree::ini_parser_error& error) {
      throw SetupError({.file = file.string(), .line = static_cast<int>(error.line()), .message = error.message()});
    }
  }

  [[nodiscard]] const std::map<std::string, std::map<std::string, std::string>>& sections() const { return sections_; }
  [[nodiscard]] int line_of(const std::string& section, const std::string& key = "") const {
    const auto found = lines_.find({section, key});
    return found == lines_.end() ? 0 : found->second;
  }
  [[nodiscard]] SetupError error(const std::string& section, const std::string& key, std::string found,
                                 std::string expected) const {
    const std::string small = lower(key);
    return SetupError({.file = file_.string(),
                       .line = line_of(section, line_of(section, small) != 0 ? small : ""),
                       .key = "[" + section + "] " + key,
                       .found = std::move(found),
                       .expected = std::move(expected)});
  }
  [[nodiscard]] std::string text(const std::string& section, const std::string& key) const {
    const auto in = sections_.find(section);
    if (in == sections_.end()) return "";
    const auto found = in->second.find(lower(key));
    return found == in->second.end() ? "" : found->second;
  }
  // nullopt if the value is missing, empty or relative to $NODEID.
  [[nodiscard]] std::optional<std::int64_t> number(const std::string& section, const std::string& key, std::int64_t low,
                                                   std::int64_t high) const {
    const std::string value = text(section, key);
    if (value.empty() || lower(value).find("$nodeid") != std::string::npos) return std::nullopt;
    const auto parsed = parse(value);
    if (!parsed || *parsed < low || *parsed > high) {
      throw error(section, key, in_quotes(value),
                  "a whole number from " + std::to_string(low) + " to " + std::to_string(high) + ", or 0x...");
    }
    return parsed;
  }
  // A value of an object: a signed number as its bits.
  [[nodiscard]] std::optional<std::uint32_t> value(const std::string& section, const std::string& key, int bits) const {
    if (bits == 0 || bits > 32) return std::nullopt;
    const std::int64_t most = (std::int64_t{1} << bits) - 1;
    const auto found = number(section, key, -(most / 2) - 1, most);
    if (!found) return std::nullopt;
    return static_cast<std::uint32_t>(*found & most);
  }

 private:
  // Numbers as in C: decimal, hexadecimal with 0x, octal with 0.
  static std::optional<std::int64_t> parse(const std::string& value) {
    const bool negative = value[0] == '-';
    const std::string digits = value.substr(negative ? 1 : 0);
    const bool hex = lower(digits).rfind("0x", 0) == 0;
    const std::string rest = hex ? digits.substr(2) : digits;
    const char* known = hex ? "0123456789abcdefABCDEF" : "0123456789";
    if (rest.empty() || rest.size() > 16 || rest.find_first_not_of(known) != std::string::npos) return std::nullopt;
    const bool octal = !hex && rest.size() > 1 && rest[0] == '0';
    if (octal && rest.find_first_of("89") != std::string::npos) return std::nullopt;
    if (hex && rest.size() > 15) return std::nullopt;
    const std::int64_t size = std::stoll(rest, nullptr, hex ? 16 : octal ? 8 : 10);
    return negative ? -size : size;
  }

  void note_lines(std::string_view text) {
    std::istringstream in{std::string(text)};
    std::string line, section;
    for (int number = 1; std::getline(in, line); ++number) {
      const std::string entry = trimmed(line);
      if (entry.empty() || entry[0] == ';' || entry[0] == '#') continue;
      if (entry[0] == '[') {
        section = lower(trimmed(std::string_view(entry).substr(1, entry.find(']') - 1)));
        lines_.emplace(std::pair(section, std::string()), number);
      } else {
        lines_.emplace(std::pair(section, lower(trimmed(std::string_view(entry).substr(0, entry.find('='))))), number);
      }
    }
  }

  std::filesystem::path file_;
  std::map<std::string, std::map<std::string, std::string>> sections_;
  std::map<std::pair<std::string, std::string>, int> lines_;
};

// Index and sub-index of a section named "1a00" or "1a00sub1"; nullopt for any other section.
std::optional<std::uint32_t> object_of(const std::string& section, bool& has_sub) {
  constexpr const char* hex = "0123456789abcdef";
  const std::size_t sub = section.find("sub");
  const std::string index = section.substr(0, sub);
  has_sub = sub != std::string::npos;
  const std::string rest = has_sub ? section.substr(sub + 3) : "0";
  if (index.size() != 4 || index.find_first_not_of(hex) != std::string::npos) return std::nullopt;
  if (rest.empty() || rest.size() > 2 || rest.find_first_not_of(hex) != std::string::npos) return std::nullopt;
  return static_cast<std::uint32_t>(std::stoul(index, nullptr, 16) << 8 | std::stoul(rest, nullptr, 16));
}

EdsObject read_object(const Ini& ini, const std::string& section) {
  EdsObject object;
  object.line = ini.line_of(section);
  object.name = ini.text(section, "ParameterName").substr(0, 80);
  const auto type = ini.number(section, "DataType", 0, 0xFFFF);
  if (!type) throw ini.error(section, "DataType", "none", "the number of a data type");
  object.bits = bits_of_type(*type);
  const std::string access = lower(ini.text(section, "AccessType"));
  constexpr const char* known[] = {"ro", "wo", "rw", "rwr", "rww", "const"};
  if (std::find(std::begin(known), std::end(known), access) == std::end(known)) {
    throw ini.error(section, "AccessType", in_quotes(access), "ro, wo, rw, rwr, rww or const");
  }
  object.readable = access != "wo";
  object.writable = access != "ro" && access != "const";
  object.mappable = ini.number(section, "PDOMapping", 0, 1).value_or(0) == 1;
  object.default_value = ini.value(section, "DefaultValue", object.bits);
  object.value = ini.value(section, "ParameterValue", object.bits);
  return object;
}

void add_objects(const Ini& ini, EdsFile& eds) {
  constexpr std::int64_t array = 8, record = 9, most_types = 0xFF;
  for (const auto& [section, keys] : ini.sections()) {
    bool has_sub = false;
    const auto address = object_of(section, has_sub);
    if (!address || keys.count("parametername") == 0) continue;
    const std::int64_t kind = ini.number(section, "ObjectType", 0, most_types).value_or(7);
    const std::int64_t alike = ini.number(section, "CompactSubObj", 0, most_sub_indices).value_or(0);
    const bool compound = !has_sub && (kind == array || kind == record);
    if (compound && alike == 0) continue;  // its sub-indices have sections of their own
    const EdsObject object = read_object(ini, section);
    if (!compound) {
      eds.objects[*address] = object;
      continue;
    }
    EdsObject& number = eds.objects[*address] = object;
    number.bits = 8;
    number.writable = number.mappable = false;
    number.default_value = number.value = std::nullopt;
    for (std::uint32_t sub = 1; sub <= static_cast<std::uint32_t>(alike); ++sub) eds.objects[*address + sub] = object;
  }
}

}  // namespace

const EdsObject* EdsFile::find(std::uint32_t object) const noexcept {
  const auto found = objects.find(object);
  return found == objects.end() ? nullptr : &found->second;
}

EdsFile parse_eds(std::string_view text, const std::filesystem::path& file) {
  const Ini ini(text, file);
  EdsFile eds;
  eds.file = file;
  constexpr std::int64_t u32 = 0xFFFFFFFF;
  const auto u32_of = [&](const char* key) -> std::optional<std::uint32_t> {
    const auto number = ini.number("deviceinfo", key, 0, u32);
    return number ? std::optional(static_cast<std::uint32_t>(*number)) : std::nullopt;
  };
  if (ini.sections().count("deviceinfo") == 0) {
    throw SetupError({.file = file.string(), .expected = "an EDS or DCF file, with a section [DeviceInfo]"});
  }
  eds.vendor = u32_of("VendorNumber");
  eds.product = u32_of("ProductNumber");
  eds.revision = u32_of("RevisionNumber");
  for (const char* section : {"devicecomissioning", "devicecommissioning"}) {
    if (const auto node = ini.number(section, "NodeID", 1, 127)) eds.node = static_cast<int>(*node);
  }
  add_objects(ini, eds);
  if (eds.objects.empty()) throw SetupError({.file = file.string(), .expected = "objects, in sections such as [1000]"});
  return eds;
}

namespace {

std::string read_text(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) throw SetupError({.file = file.string(), .expected = "a file that can be read"});
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

}  // namespace

EdsFile load_eds(const std::filesystem::path& file) { return parse_eds(read_text(file), file); }

void require_bitrate(std::string_view eds_text, const std::filesystem::path& file, std::int64_t bitrate) {
  const Ini ini(eds_text, file);
  std::string known;
  for (const int kilobits : {10, 20, 50, 125, 250, 500, 800, 1000}) {
    if (ini.number("deviceinfo", "BaudRate_" + std::to_string(kilobits), 0, 1).value_or(0) == 0) continue;
    if (bitrate == std::int64_t{1000} * kilobits) return;
    known += (known.empty() ? "" : ", ") + std::to_string(1000 * kilobits);
  }
  if (known.empty()) return;
  throw ini.error("deviceinfo", "BaudRate_" + std::to_string(bitrate / 1000), "not there, or 0",
                  "1: the cell's bus runs at " + std::to_string(bitrate) + " bit/s, this device at " + known);
}

void require_bitrate(const std::filesystem::path& file, std::int64_t bitrate) {
  require_bitrate(read_text(file), file, bitrate);
}

}  // namespace proxarm::description
