#include "models/files/eds_file.hpp"

#include <algorithm>
#include <bit>
#include <cctype>
#include <fstream>
#include <sstream>

#include "models/base/setup_error.hpp"
#include "models/base/text.hpp"
#include "models/files/eds_bitrates.hpp"
#include "models/files/ini_file.hpp"

namespace proxarm::description {
namespace {

constexpr std::int64_t u32 = 0xFFFFFFFF;
constexpr int most_sub_indices = 254, real32 = 0x08;

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

struct DataType {
  int number = 0, bits = 0;
  bool is_signed = false;
};

// Returns the type with this number in CiA 301, table 44. It has 0 bits if it isn't a number of 1 to 64 bits.
DataType data_type(std::int64_t number) noexcept {
  constexpr DataType types[] = {{0x01, 1},        {0x02, 8, true},  {0x03, 16, true}, {0x04, 32, true}, {0x05, 8},
                                {0x06, 16},       {0x07, 32},       {real32, 32},     {0x10, 24, true}, {0x11, 64},
                                {0x12, 40, true}, {0x13, 48, true}, {0x14, 56, true}, {0x15, 64, true}, {0x16, 24},
                                {0x18, 40},       {0x19, 48},       {0x1A, 56},       {0x1B, 64}};
  for (const DataType& type : types) {
    if (type.number == number) return type;
  }
  return {};
}

// Returns the value of a text such as "$NODEID+0x180", for a known node. The text is a sum that contains $NODEID
// exactly once, in upper or lower case, in any order, with spaces or in brackets.
std::optional<std::int64_t> relative_value(const std::string& text, int node) {
  std::string sum = lower(text);
  std::erase_if(sum, [](unsigned char c) { return std::isspace(c) != 0; });
  if (sum.size() > 2 && sum.front() == '(' && sum.back() == ')') sum = sum.substr(1, sum.size() - 2);
  std::int64_t total = 0;
  int nodes = 0;
  std::istringstream terms(sum + "+0");
  for (std::string term; std::getline(terms, term, '+');) {
    if (term == "$nodeid") {
      total += node;
      ++nodes;
      continue;
    }
    const auto number = IniFile("[x]\nvalue=" + term, "").number("x", "value", 0, u32);
    if (!number) return std::nullopt;
    total += *number;
  }
  return nodes == 1 ? std::optional(total) : std::nullopt;
}

// Returns an object's value as bits. A signed value may be written as a decimal number, or as the bits of its type or
// of a wider type.
std::optional<std::uint32_t> value_of(const IniFile& ini, const std::string& section, const std::string& key,
                                      const DataType& type, std::optional<int> node) {
  if (type.bits == 0 || type.bits > 32) return std::nullopt;
  const std::string text = ini.text(section, key);
  if (type.number == real32 && lower(text).rfind("0x", 0) != 0) {
    if (text.empty()) return std::nullopt;
    const auto real = strict_number(text);
    if (!real) throw ini.error(section, key, in_quotes(text), "a number");
    return std::bit_cast<std::uint32_t>(static_cast<float>(*real));
  }
  const std::int64_t most = (std::int64_t{1} << type.bits) - 1, least = -(most / 2) - 1;
  if (node && lower(text).find("$nodeid") != std::string::npos) {
    const auto sum = relative_value(text, *node);
    if (!sum || *sum > most) throw ini.error(section, key, in_quotes(text), "$NODEID+0x...");
    return static_cast<std::uint32_t>(*sum);
  }
  if (type.is_signed) {
    if (const auto wide = ini.number(section, key, least, u32); wide && *wide > u32 + least) {
      return static_cast<std::uint32_t>(*wide & most);
    }
  }
  const auto found = ini.number(section, key, least, most);
  if (!found) return std::nullopt;
  return static_cast<std::uint32_t>(*found & most);
}

// Returns index and sub-index of a section named "1a00" or "1a00sub1", or nullopt for any other section.
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

class Reader {
 public:
  Reader(const IniFile& ini, EdsFile& eds) : ini_(ini), eds_(eds) {}

  void read_objects() {
    for (const auto& [section, keys] : ini_.sections()) {
      bool has_sub = false;
      const auto address = object_of(section, has_sub);
      if (address && keys.values.count("parametername") != 0) add(section, keys, *address, has_sub);
    }
    for (const auto& [section, keys] : ini_.sections()) {
      bool has_sub = false;
      if (section.size() != 9 || section.substr(4) != "value") continue;
      if (const auto address = object_of(section.substr(0, 4), has_sub)) set_compact(section, keys, *address);
    }
    if (unreadable_) throw SetupError(*unreadable_);
  }

 private:
  void add(const std::string& section, const IniFile::Section& keys, std::uint32_t address, bool has_sub) {
    constexpr std::int64_t array = 8, record = 9, most_types = 0xFF;
    EdsObject object;
    object.line = keys.line;
    object.name = ini_.text(section, "ParameterName").substr(0, 80);
    std::int64_t kind = 7, alike = 0;
    try {
      kind = ini_.number(section, "ObjectType", 0, most_types).value_or(7);
      alike = ini_.number(section, "CompactSubObj", 0, most_sub_indices).value_or(0);
      if (!keys.mistake.empty()) {
        throw SetupError({.file = eds_.file.string(),
                          .line = keys.mistake_line,
                          .key = "[" + section + "]",
                          .message = keys.mistake});
      }
      const bool compound = !has_sub && (kind == array || kind == record);
      if (compound && alike == 0) return;  // the object's sub-indices have separate sections
      read(object, section, kind);
    } catch (const SetupError& error) {
      object.mistake = error.what();
      eds_.remarks.push_back(object.mistake);
    }
    const bool compact = !has_sub && (kind == array || kind == record);
    EdsObject& first = eds_.objects[address] = object;
    if (!compact) return;
    first.bits = 8;
    first.writable = first.mappable = false;
    first.default_value = first.value = first.default_offset = std::nullopt;
    first.low = first.high = std::nullopt;
    for (std::uint32_t sub = 1; sub <= static_cast<std::uint32_t>(alike); ++sub) eds_.objects[address + sub] = object;
  }

  void read(EdsObject& object, const std::string& section, std::int64_t kind) {
    constexpr std::int64_t variable = 7, array = 8, record = 9;
    const auto number = ini_.number(section, "DataType", 0, 0xFFFF);
    const bool holds_data = kind == variable || kind == array || kind == record;
    if (!number && holds_data) throw ini_.error(section, "DataType", "none", "the number of a data type");
    const DataType type = data_type(number.value_or(0));
    object.type = type.number;
    object.bits = type.bits;
    // A value that a DCF sets must be readable, even if something else in this object is wrong.
    object.value = value_that_is_set(section, "ParameterValue", type);
    const std::string access = lower(ini_.text(section, "AccessType"));
    constexpr const char* known[] = {"ro", "wo", "rw", "rwr", "rww", "const"};
    if (std::find(std::begin(known), std::end(known), access) == std::end(known) && (holds_data || !access.empty())) {
      throw ini_.error(section, "AccessType", in_quotes(access), "ro, wo, rw, rwr, rww or const");
    }
    object.readable = access != "wo";
    object.writable = access != "ro" && access != "const";
    object.mappable = ini_.number(section, "PDOMapping", 0, 1).value_or(0) == 1;
    try {
      read_default(object, section, type);
    } catch (const SetupError& error) {
      eds_.remarks.push_back(error.what());
    }
    try {
      read_limits(object, section, type);
    } catch (const SetupError& error) {
      eds_.remarks.push_back(error.what());
    }
  }

  void read_default(EdsObject& object, const std::string& section, const DataType& type) {
    const std::string text = ini_.text(section, "DefaultValue");
    if (type.bits == 0) {
      object.default_text = text.substr(0, 80);
    } else if (type.bits <= 32 && lower(text).find("$nodeid") != std::string::npos) {
      object.default_offset = value_of(ini_, section, "DefaultValue", type, 0);
    } else {
      object.default_value = value_of(ini_, section, "DefaultValue", type, std::nullopt);
    }
  }

  // Reads the limits of an object. Two equal limits count as no limits, because some tools write this.
  void read_limits(EdsObject& object, const std::string& section, const DataType& type) {
    if (type.number == real32) return;
    const auto limit = [&](const char* key) -> std::optional<std::int64_t> {
      const auto bits = value_of(ini_, section, key, type, std::nullopt);
      if (!bits) return std::nullopt;
      const std::int64_t wrap = std::int64_t{1} << type.bits;
      return type.is_signed && *bits >= wrap / 2 ? *bits - wrap : std::int64_t{*bits};
    };
    object.low = limit("LowLimit");
    object.high = limit("HighLimit");
    if (object.low && object.high && *object.low >= *object.high) object.low = object.high = std::nullopt;
  }

  // Returns a value that a DCF sets. If it can't be read, the whole file is refused, because the drive wouldn't get all
  // values of the file.
  std::optional<std::uint32_t> value_that_is_set(const std::string& section, const std::string& key,
                                                 const DataType& type) {
    try {
      return value_of(ini_, section, key, type, eds_.node);
    } catch (const SetupError& error) {
      if (!unreadable_) unreadable_ = error;
      return std::nullopt;
    }
  }

  // Sets values from a section such as [1016Value] with 1=0x7F0064, by sub-index.
  void set_compact(const std::string& section, const IniFile::Section& keys, std::uint32_t address) {
    for (const auto& [key, text] : keys.values) {
      if (key == "nrofentries") continue;
      const auto sub = strict_integer(key);
      const auto object = sub && *sub >= 1 && *sub <= most_sub_indices
                              ? eds_.objects.find(address + static_cast<std::uint32_t>(*sub))
                              : eds_.objects.end();
      if (object == eds_.objects.end()) throw ini_.error(section, key, "no such sub-index", "one that the object has");
      object->second.value = value_that_is_set(section, key, data_type(object->second.type));
    }
  }

  const IniFile& ini_;
  EdsFile& eds_;
  std::optional<SetupError> unreadable_;
};

}  // namespace

const EdsObject* EdsFile::find(std::uint32_t object) const noexcept {
  const auto found = objects.find(object);
  return found == objects.end() ? nullptr : &found->second;
}

EdsFile parse_eds(std::string_view text, const std::filesystem::path& file) {
  const IniFile ini(text, file);
  EdsFile eds;
  eds.file = file;
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
  for (const char* section : {"devicecomissioning", "devicecommissioning", "devicecommisioning"}) {
    if (const auto node = ini.number(section, "NodeID", 1, 127)) eds.node = static_cast<int>(*node);
  }
  Reader reader(ini, eds);
  reader.read_objects();
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
  const IniFile ini(eds_text, file);
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
