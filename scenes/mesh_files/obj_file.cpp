#include <algorithm>
#include <array>
#include <cmath>
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

// True for keywords that don't describe geometry.
bool says_nothing(std::string_view keyword) {
  constexpr std::array ignored{"vt",       "vn",         "vp",        "g",     "o",   "s",   "mg",   "usemtl",
                               "mtllib",   "usemap",     "maplib",    "bevel", "lod", "csh", "call", "c_interp",
                               "d_interp", "shadow_obj", "trace_obj", "bsp",   "bzp", "cdc", "cdp",  "res"};
  return std::find(ignored.begin(), ignored.end(), keyword) != ignored.end();
}

bool is_free_form(std::string_view keyword) {
  constexpr std::array free_form{"cstype", "deg",  "bmat", "step", "curv", "curv2", "surf",  "parm",
                                 "trim",   "hole", "scrv", "sp",   "end",  "con",   "ctech", "stech"};
  return std::find(free_form.begin(), free_form.end(), keyword) != free_form.end();
}

class ObjText {
 public:
  explicit ObjText(std::string_view bytes) : bytes_(bytes), text_(bytes) {}

  ParsedMesh parse() {
    while (!text_.at_end()) {
      const std::size_t number = text_.line();
      where_ = "line " + std::to_string(number);
      read_line(whole_line());
    }
    require_as_announced();
    ParsedMesh mesh = mesh_.finish();
    require_ended(mesh.account);
    return mesh;
  }

 private:
  // Returns the current line, together with the lines that a backslash at its end joins to it.
  std::string_view whole_line() {
    std::string_view line = text_.rest_of_line();
    if (!line.ends_with('\\')) return line;
    joined_.clear();
    while (line.ends_with('\\')) {
      joined_.append(line.substr(0, line.size() - 1)).push_back(' ');
      line = text_.rest_of_line();
    }
    joined_.append(line);
    return joined_;
  }

  void read_line(std::string_view line) {
    if (line.starts_with('#')) return read_comment(line);
    line = line.substr(0, line.find('#'));
    const std::string_view keyword = next_word(line);
    if (keyword == "v") return read_vertex(line);
    if (keyword == "f" || keyword == "fo") return read_face(line);
    if (keyword == "p" || keyword == "l") return mesh_.add_points_and_lines(1);
    if (keyword.empty() || says_nothing(keyword)) return;
    if (is_free_form(keyword)) {
      throw std::runtime_error(where_ + ": " + description::in_quotes(std::string(keyword)) +
                               ", a free-form curve or surface, where polygons are expected: export triangles");
    }
    throw std::runtime_error(where_ + ": " + description::in_quotes(std::string(keyword), 40) +
                             " where v, f or another word of OBJ was expected");
  }

  // Reads x y z, optionally followed by a weight or a colour.
  void read_vertex(std::string_view line) {
    std::array<double, 3> x{};
    for (double& coordinate : x) {
      const std::string_view number = next_word(line);
      coordinate = number_of(number, where_);
      mesh_.note_written(number);
    }
    std::size_t more = 0;
    double weight = 1.0;
    for (std::string_view word = next_word(line); !word.empty(); word = next_word(line)) {
      const double value = number_of(word, where_);
      if (more++ == 0) weight = value;
    }
    if (more == 1 && weight != 1.0) {
      throw std::runtime_error(where_ + ": a vertex with the weight " + description::number_text(weight) +
                               ", where a mesh has 1 or none");
    }
    if (!mesh_.add_vertex(x[0], x[1], x[2])) refuse_not_finite(where_);
  }

  // Reads a face. Each corner is v, v/vt, v//vn or v/vt/vn. Numbers count from 1; negative numbers count back from the
  // last vertex.
  void read_face(std::string_view line) {
    corners_.clear();
    for (std::string_view word = next_word(line); !word.empty(); word = next_word(line)) {
      const std::int64_t given = whole_number_of(word.substr(0, word.find('/')), where_);
      const auto known = static_cast<std::int64_t>(mesh_.vertices());
      const std::int64_t corner = given > 0 ? given - 1 : known + given;
      if (given == 0 || corner < 0) {
        throw std::runtime_error(where_ + ": vertex " + std::to_string(given) + " of " + std::to_string(known));
      }
      corners_.push_back(corner);
      highest_ = std::max(highest_, corner);
    }
    mesh_.add_face(corners_);
  }

  // Reads a comment, because some programs announce a count in a comment: "# Faces: 12" (MeshLab), "# Mesh 'part' with
  // 12 faces" (assimp).
  void read_comment(std::string_view line) {
    line.remove_prefix(1);
    std::vector<std::string_view> words;
    for (std::string_view word = next_word(line); !word.empty() && words.size() < 12; word = next_word(line)) {
      words.push_back(word);
    }
    const auto count = [](std::string_view word) -> std::optional<std::uint64_t> {
      if (word.empty() || word.size() > 15 || word.find_first_not_of("0123456789") != word.npos) return std::nullopt;
      return std::stoull(std::string(word));
    };
    if (words.size() == 2 && words[0] == "Faces:") announced_faces_ += count(words[1]).value_or(0);
    if (words.size() == 2 && words[0] == "Vertices:") announced_vertices_ += count(words[1]).value_or(0);
    const std::size_t n = words.size();
    if (n >= 5 && words[0] == "Mesh" && words[n - 1] == "faces" && words[n - 3] == "with") {
      announced_faces_ += count(words[n - 2]).value_or(0);
    }
  }

  void require_as_announced() const {
    const auto require = [](std::uint64_t announced, std::uint64_t found, const char* what) {
      if (announced <= found) return;
      throw std::runtime_error("it is cut off: a comment says " + std::to_string(announced) + what + ", and " +
                               std::to_string(found) + " are there");
    };
    require(announced_vertices_, mesh_.vertices(), " vertices");
    require(announced_faces_, mesh_.account().faces, " faces");
  }

  // Throws if the file is cut off. OBJ has no end mark. So a file counts as cut off if its last line has no line end
  // and no face uses its last vertices.
  void require_ended(const FaceAccount& account) const {
    const bool ended = bytes_.empty() || bytes_.back() == '\n' || bytes_.back() == '\r';
    if (ended || account.unused_vertices == 0 || highest_ + 1 == static_cast<std::int64_t>(account.vertices)) return;
    throw std::runtime_error("it is cut off: its last line doesn't end, and no face uses " +
                             std::to_string(account.unused_vertices) + " of its " + std::to_string(account.vertices) +
                             " vertices");
  }

  std::string_view bytes_;
  TextScanner text_;
  std::string joined_, where_;
  MeshBuilder mesh_;
  std::vector<std::int64_t> corners_;
  std::int64_t highest_ = -1;
  std::uint64_t announced_faces_ = 0, announced_vertices_ = 0;
};

}  // namespace

ParsedMesh parse_obj(std::string_view bytes) {
  if (bytes.starts_with("\xef\xbb\xbf")) bytes.remove_prefix(3);
  if (bytes.find('\0') != std::string_view::npos) throw std::runtime_error("zeros in it, where OBJ is text");
  return ObjText(bytes).parse();
}

}  // namespace proxarm::scenes
