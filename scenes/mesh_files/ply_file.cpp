#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "models/base/setup_error.hpp"
#include "scenes/mesh_files/formats.hpp"
#include "scenes/mesh_files/mesh_builder.hpp"
#include "scenes/mesh_files/text_scanner.hpp"

namespace proxarm::scenes {
namespace {

using description::in_quotes;

enum class Type : std::uint8_t { i8, u8, i16, u16, i32, u32, f32, f64 };

std::size_t size_of(Type type) {
  constexpr std::array<std::size_t, 8> sizes{1, 1, 2, 2, 4, 4, 4, 8};
  return sizes[static_cast<std::size_t>(type)];
}

Type type_of(std::string_view name, const std::string& where) {
  constexpr std::array<std::array<std::string_view, 2>, 8> names{{{"char", "int8"},
                                                                  {"uchar", "uint8"},
                                                                  {"short", "int16"},
                                                                  {"ushort", "uint16"},
                                                                  {"int", "int32"},
                                                                  {"uint", "uint32"},
                                                                  {"float", "float32"},
                                                                  {"double", "float64"}}};
  for (std::size_t k = 0; k < names.size(); ++k) {
    if (name == names[k][0] || name == names[k][1]) return static_cast<Type>(k);
  }
  throw std::runtime_error(where + ": " + in_quotes(std::string(name), 40) + " where a type of PLY was expected");
}

struct Property {
  std::string name;
  Type type = Type::f32;
  std::optional<Type> counted_by;  // type of the count of a list; nullopt: the property isn't a list
};

struct Element {
  std::string name;
  std::uint64_t count = 0;
  std::vector<Property> properties;
};

enum class Format : std::uint8_t { text, little_endian, big_endian };

struct Header {
  Format format = Format::text;
  std::vector<Element> elements;
  std::size_t end = 0;  // position at which the data begin
};

// Parses a line such as "element face 12".
Element element_of(std::string_view line, const std::string& where) {
  Element element;
  element.name = next_word(line);
  const long long count = whole_number_of(next_word(line), where);
  if (count < 0) throw std::runtime_error(where + ": an element of " + std::to_string(count));
  element.count = static_cast<std::uint64_t>(count);
  return element;
}

// Parses a line such as "property float x" or "property list uchar int vertex_indices".
Property property_of(std::string_view line, const std::string& where) {
  Property property;
  std::string_view type = next_word(line);
  if (type == "list") {
    property.counted_by = type_of(next_word(line), where);
    type = next_word(line);
  }
  property.type = type_of(type, where);
  property.name = next_word(line);
  return property;
}

Format format_of(std::string_view line, const std::string& where) {
  const std::string_view name = next_word(line);
  if (name == "ascii") return Format::text;
  if (name == "binary_little_endian") return Format::little_endian;
  if (name == "binary_big_endian") return Format::big_endian;
  throw std::runtime_error(where + ": the format " + in_quotes(std::string(name), 40) +
                           " where ascii, binary_little_endian or binary_big_endian was expected");
}

Header header_of(std::string_view bytes) {
  // The data begin right after the header's last line. This line has the same line end as the first line.
  const std::size_t first = bytes.find_first_of("\r\n");
  const std::string_view ending = first == bytes.npos                       ? "\n"
                                  : bytes.substr(first).starts_with("\r\n") ? "\r\n"
                                                                            : bytes.substr(first, 1);
  if (!bytes.starts_with("ply")) throw std::runtime_error("no PLY file, which begins with \"ply\"");
  Header header;
  bool formatted = false;
  std::size_t number = 0;
  for (std::size_t at = 0; at < bytes.size();) {
    const std::size_t end = std::min(bytes.find(ending, at), bytes.size());
    std::string_view line = bytes.substr(at, end - at);
    const std::string where = "line " + std::to_string(++number);
    at = end + ending.size();
    const std::string_view keyword = next_word(line);
    if (keyword == "end_header") {
      if (!formatted) throw std::runtime_error("no format in its header");
      header.end = std::min(at, bytes.size());
      return header;
    }
    if (keyword == "format") {
      header.format = format_of(line, where);
      formatted = true;
    } else if (keyword == "element") {
      header.elements.push_back(element_of(line, where));
    } else if (keyword == "property" && !header.elements.empty()) {
      header.elements.back().properties.push_back(property_of(line, where));
    } else if (number > 1 && !keyword.empty() && keyword != "comment" && keyword != "obj_info") {
      throw std::runtime_error(where + ": " + in_quotes(std::string(keyword), 40) +
                               " where format, element, property or end_header was expected");
    }
  }
  throw std::runtime_error("no end_header");
}

// Reads the values after the header, in the order of the file.
class Values {
 public:
  Values(std::string_view data, Format format) : data_(data), text_(data), format_(format) {}

  [[nodiscard]] bool binary() const noexcept { return format_ != Format::text; }
  // Returns the last value as it is written in a text file; empty for a binary file.
  [[nodiscard]] std::string_view written() const noexcept { return written_; }
  [[nodiscard]] std::size_t left() const noexcept { return data_.size() - (binary() ? at_ : text_.at()); }

  double next(Type type, const std::string& of) {
    if (!binary()) {
      const std::string_view word = text_.word();
      if (word.empty()) cut_off(of);
      written_ = word;
      return number_of(word, of);
    }
    const std::size_t size = size_of(type);
    if (size > data_.size() - at_) cut_off(of);
    std::array<char, 8> raw{};
    std::memcpy(raw.data(), data_.data() + at_, size);
    at_ += size;
    if (format_ == Format::big_endian) std::reverse(raw.begin(), raw.begin() + static_cast<std::ptrdiff_t>(size));
    return value_of(raw, type);
  }

  std::int64_t next_whole(Type type, const std::string& of) {
    const double value = next(type, of);
    if (!(std::abs(value) < 1e15) || value != std::floor(value)) {
      throw std::runtime_error(of + ": " + description::number_text(value) + " where a whole number was expected");
    }
    return static_cast<std::int64_t>(value);
  }

  // Returns the number of bytes after the last element of a binary file. Throws if a text file has more text after its
  // last element.
  std::uint64_t behind() {
    if (binary()) return left();
    const std::string_view word = text_.word();
    if (word.empty()) return 0;
    throw std::runtime_error("more behind its last element than its header says: " + in_quotes(std::string(word), 40));
  }

 private:
  [[noreturn]] static void cut_off(const std::string& of) { throw std::runtime_error("it is cut off in " + of); }

  static_assert(std::endian::native == std::endian::little);
  template <typename Number>
  static double as(const std::array<char, 8>& raw) {
    Number value{};
    std::memcpy(&value, raw.data(), sizeof value);
    return static_cast<double>(value);
  }
  static double value_of(const std::array<char, 8>& raw, Type type) {
    switch (type) {
      case Type::i8:
        return as<std::int8_t>(raw);
      case Type::u8:
        return as<std::uint8_t>(raw);
      case Type::i16:
        return as<std::int16_t>(raw);
      case Type::u16:
        return as<std::uint16_t>(raw);
      case Type::i32:
        return as<std::int32_t>(raw);
      case Type::u32:
        return as<std::uint32_t>(raw);
      case Type::f32:
        return as<float>(raw);
      case Type::f64:
        return as<double>(raw);
    }
    return 0.0;
  }

  std::string_view data_;
  std::string_view written_;
  TextScanner text_;
  Format format_;
  std::size_t at_ = 0;
};

class Ply {
 public:
  explicit Ply(std::string_view bytes)
      : header_(header_of(bytes)), values_(bytes.substr(header_.end), header_.format) {}

  ParsedMesh parse() {
    for (const Element& element : header_.elements) {
      require_room(element);
      if (element.name == "vertex") {
        require_coordinates(element);
      } else if (element.name == "face" || element.name == "tristrips") {
        require_corners(element);
      } else if (element.name == "edge") {
        mesh_.add_points_and_lines(element.count);
      }
      for (std::uint64_t i = 0; i < element.count; ++i) read(element, i);
    }
    mesh_.add_bytes_behind(values_.behind());
    return mesh_.finish();
  }

 private:
  static bool names_corners(const Property& property) {
    return property.counted_by && (property.name == "vertex_indices" || property.name == "vertex_index");
  }

  // Throws if the file is too short for the element: a header may announce any count, but each value needs at least one
  // byte in the file.
  void require_room(const Element& element) const {
    std::size_t least = 0;
    for (const Property& property : element.properties) {
      least += values_.binary() ? size_of(property.counted_by.value_or(property.type)) : 2;
    }
    if (element.properties.empty() ? element.count == 0 : element.count <= (values_.left() + 1) / least) return;
    throw std::runtime_error("it is cut off: its header says " + std::to_string(element.count) + " of " +
                             in_quotes(element.name, 40) + ", and " + std::to_string(values_.left()) +
                             " bytes are left for them");
  }

  static void require_coordinates(const Element& element) {
    for (const char* name : {"x", "y", "z"}) {
      const auto is = [name](const Property& property) { return property.name == name && !property.counted_by; };
      if (std::count_if(element.properties.begin(), element.properties.end(), is) != 1) {
        throw std::runtime_error("vertices without one " + std::string(name));
      }
    }
  }

  static void require_corners(const Element& element) {
    const auto& properties = element.properties;
    if (element.count == 0 || std::count_if(properties.begin(), properties.end(), names_corners) == 1) return;
    throw std::runtime_error("the element " + element.name + " without a list vertex_indices or vertex_index");
  }

  void read(const Element& element, std::uint64_t i) {
    const std::string of = element.name + " " + std::to_string(i);
    std::array<double, 3> x{};
    for (const Property& property : element.properties) {
      if (!property.counted_by) {
        const double value = values_.next(property.type, of);
        if (property.name.size() == 1 && property.name[0] >= 'x' && property.name[0] <= 'z') {
          x[static_cast<std::size_t>(property.name[0] - 'x')] = value;
          if (element.name == "vertex" && !values_.binary()) mesh_.note_written(values_.written());
        }
        continue;
      }
      const std::int64_t count = values_.next_whole(*property.counted_by, of);
      if (count < 0 || static_cast<std::uint64_t>(count) > values_.left()) {
        throw std::runtime_error("it is cut off in " + of + ": a list of " + std::to_string(count));
      }
      const bool wanted = names_corners(property);
      if (wanted) corners_.clear();
      for (std::int64_t k = 0; k < count; ++k) {
        if (wanted) {
          corners_.push_back(values_.next_whole(property.type, of));
        } else {
          (void)values_.next(property.type, of);
        }
      }
    }
    if (element.name == "vertex" && !mesh_.add_vertex(x[0], x[1], x[2])) refuse_not_finite(of);
    if (element.name == "face") mesh_.add_face(corners_);
    if (element.name == "tristrips") mesh_.add_strip(corners_);
  }

  Header header_;
  Values values_;
  MeshBuilder mesh_;
  std::vector<std::int64_t> corners_;
};

}  // namespace

ParsedMesh parse_ply(std::string_view bytes) { return Ply(bytes).parse(); }

}  // namespace proxarm::scenes
