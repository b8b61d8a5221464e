#include <array>
#include <bit>
#include <cstring>
#include <stdexcept>
#include <string>
#include <vector>

#include "models/base/setup_error.hpp"
#include "scenes/mesh_files/formats.hpp"
#include "scenes/mesh_files/mesh_builder.hpp"
#include "scenes/mesh_files/text_scanner.hpp"

namespace proxarm::scenes {
namespace {

static_assert(std::endian::native == std::endian::little, "binary STL is read as it is in memory");

// Binary STL: 80 arbitrary bytes, the number of triangles (u32), then 50 bytes for each triangle.
constexpr std::size_t head_bytes = 84, facet_bytes = 50, normal_bytes = 12, vertex_bytes = 12;

std::uint32_t count_in(std::string_view bytes) {
  std::uint32_t count = 0;
  std::memcpy(&count, bytes.data() + 80, sizeof count);
  return count;
}

ParsedMesh parse_binary(std::string_view bytes) {
  if (bytes.size() < head_bytes) {
    throw std::runtime_error(std::to_string(bytes.size()) + " bytes, where a binary STL has 84 before its triangles");
  }
  const std::uint64_t count = count_in(bytes);
  const std::size_t body = bytes.size() - head_bytes;
  if (count > body / facet_bytes) {
    throw std::runtime_error("it is cut off: its header says " + std::to_string(count) + " triangles, and " +
                             std::to_string(body / facet_bytes) + " are whole");
  }
  if (body >= facet_bytes * (count + 1)) {
    throw std::runtime_error("its header says " + std::to_string(count) + " triangles, and there is room for " +
                             std::to_string(body / facet_bytes));
  }
  MeshBuilder mesh;
  mesh.reserve(3 * count, count);
  for (std::uint64_t t = 0; t < count; ++t) {
    const char* at = bytes.data() + head_bytes + facet_bytes * t + normal_bytes;
    for (std::size_t k = 0; k < 3; ++k, at += vertex_bytes) {
      std::array<float, 3> x{};
      std::memcpy(x.data(), at, sizeof x);
      if (!mesh.add_vertex(x[0], x[1], x[2])) refuse_not_finite("triangle " + std::to_string(t));
    }
    const auto first = static_cast<std::int64_t>(3 * t);
    mesh.add_face(std::array{first, first + 1, first + 2});
  }
  mesh.add_bytes_behind(body - facet_bytes * count);
  return mesh.finish();
}

// Text STL: solid NAME, then facets: facet normal i j k, outer loop, vertex x y z …, endloop, endfacet; endsolid NAME.
class TextStl {
 public:
  explicit TextStl(std::string_view bytes) : text_(bytes) {}

  ParsedMesh parse() {
    for (std::string word = next(); !word.empty(); word = next()) {
      if (word != "solid") refuse(word, "solid");
      read_solid();
    }
    return mesh_.finish();
  }

 private:
  std::string next() { return lower(text_.word()); }

  [[noreturn]] void refuse(const std::string& word, const char* expected) const {
    throw std::runtime_error(text_.where() + ": " +
                             (text_.at_end() ? "it is cut off" : description::in_quotes(word, 40)) + " where " +
                             expected + " was expected");
  }
  void expect(const char* wanted) {
    const std::string word = next();
    if (word != wanted) refuse(word, wanted);
  }

  void read_solid() {
    // The name is the rest of the line, unless the whole solid stands on one line.
    TextScanner ahead = text_;
    const std::string name = lower(ahead.rest_of_line());
    std::string word;
    if (name.find("facet normal") == std::string::npos && name.find("endsolid") == std::string::npos) {
      text_ = ahead;
      word = next();
    } else {
      do word = next();
      while (!word.empty() && word != "facet" && word != "endsolid");
    }
    for (; word == "facet"; word = next()) read_facet();
    if (word != "endsolid") refuse(word, "facet or endsolid");
    (void)text_.rest_of_line();
  }

  void read_facet() {
    expect("normal");
    for (int k = 0; k < 3; ++k) (void)text_.word();  // ignored: the order of the corners gives the normal
    expect("outer");
    expect("loop");
    corners_.clear();
    std::string word = next();
    for (; word == "vertex"; word = next()) {
      std::array<double, 3> x{};
      for (double& coordinate : x) {
        const std::string_view number = text_.word();
        coordinate = number_of(number, text_.where());
        mesh_.note_written(number);
      }
      corners_.push_back(static_cast<std::int64_t>(mesh_.vertices()));
      if (!mesh_.add_vertex(x[0], x[1], x[2])) refuse_not_finite(text_.where());
    }
    if (word != "endloop") refuse(word, "vertex or endloop");
    expect("endfacet");
    mesh_.add_face(corners_);
  }

  TextScanner text_;
  MeshBuilder mesh_;
  std::vector<std::int64_t> corners_;
};

}  // namespace

ParsedMesh parse_stl(std::string_view bytes) {
  const bool sized =
      bytes.size() >= head_bytes && bytes.size() == head_bytes + facet_bytes * std::uint64_t{count_in(bytes)};
  std::string_view text = bytes;
  if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);
  TextScanner scanner(text.substr(0, 1000));
  if (sized || lower(scanner.word()) != "solid") return parse_binary(bytes);
  // A damaged binary file may also begin with "solid", but it contains zero bytes, which a text file doesn't.
  if (text.find('\0') != std::string_view::npos) return parse_binary(bytes);
  return TextStl(text).parse();
}

}  // namespace proxarm::scenes
