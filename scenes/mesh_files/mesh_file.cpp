#include "scenes/mesh_files/mesh_file.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstring>
#include <fstream>
#include <iterator>
#include <limits>
#include <stdexcept>
#include <string>
#include <system_error>
#include <vector>

#include "models/base/setup_error.hpp"
#include "models/mesh/mesh_repair.hpp"
#include "models/mesh/mesh_topology.hpp"
#include "scenes/mesh_files/formats.hpp"
#include "scenes/mesh_files/mesh_cache.hpp"
#include "scenes/mesh_files/sandbox.hpp"
#include "scenes/mesh_files/text_scanner.hpp"

namespace proxarm::scenes {
namespace {

using description::in_quotes;
using description::SetupError;
using models::TriangleMesh;
using models::TriangleSoup;
using models::Vec3;

// About five million triangles of a binary STL. The parser's limits of time and memory grow with the size of the file.
constexpr std::uintmax_t most_bytes = std::uintmax_t{256} << 20;

constexpr const char* kExpected = "a mesh: STL, OBJ or PLY, with triangles";

// Returns the size of a regular file. Throws SetupError if the file is too large. Also refuses a pipe, because reading
// from it could block without end.
std::uintmax_t checked_size(const std::filesystem::path& file) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error)) {
    const bool exists = std::filesystem::exists(file, error);
    throw SetupError(
        {.file = file.string(), .found = exists ? "no regular file" : "no such file", .expected = kExpected});
  }
  const std::uintmax_t bytes = std::filesystem::file_size(file, error);
  if (!error && bytes <= most_bytes) return bytes;
  throw SetupError({.file = file.string(),
                    .found = error ? error.message() : std::to_string(bytes >> 20) + " MiB",
                    .expected = "a mesh file of at most " + std::to_string(most_bytes >> 20) + " MiB",
                    .advice = "a coarser mesh feels the same"});
}

std::string contents_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) throw std::runtime_error("nothing that can be read");
  std::string bytes{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  if (in.bad()) throw std::runtime_error("nothing that can be read");
  return bytes;
}

// Parses the file. The extension selects the format. A damaged file can keep a parser busy for a long time, so this
// function runs in a sandbox. Throws std::runtime_error with the problem.
ParsedMesh parse(const std::filesystem::path& file, const std::string& extension) {
  const std::string bytes = contents_of(file);
  if (bytes.starts_with("\xff\xfe") || bytes.starts_with("\xfe\xff")) {
    throw std::runtime_error("text in UTF-16: save it as plain text (ASCII or UTF-8)");
  }
  if (extension == ".stl") return parse_stl(bytes);
  return extension == ".obj" ? parse_obj(bytes) : parse_ply(bytes);
}

// The head of a parsed mesh as bytes, in which the mesh is passed out of the sandbox.
struct Counts {
  FaceAccount account;
  double last_digit = 0.0;
  std::uint64_t vertices = 0, triangles = 0;
};

std::vector<std::byte> bytes_of(const ParsedMesh& mesh) {
  const TriangleSoup& soup = mesh.soup;
  const Counts counts{mesh.account, mesh.last_digit, soup.vertices.size(), soup.triangles.size()};
  const std::size_t vertices = soup.vertices.size() * sizeof(Vec3);
  const std::size_t triangles = soup.triangles.size() * sizeof(soup.triangles[0]);
  std::vector<std::byte> bytes(sizeof counts + vertices + triangles);
  std::memcpy(bytes.data(), &counts, sizeof counts);
  for (std::size_t v = 0; v < soup.vertices.size(); ++v) {
    std::memcpy(bytes.data() + sizeof counts + v * sizeof(Vec3), soup.vertices[v].data(), sizeof(Vec3));
  }
  std::memcpy(bytes.data() + sizeof counts + vertices, soup.triangles.data(), triangles);
  return bytes;
}

ParsedMesh mesh_of(const std::vector<std::byte>& bytes) {
  Counts counts;
  if (bytes.size() < sizeof counts) throw std::runtime_error("nothing that can be read");
  std::memcpy(&counts, bytes.data(), sizeof counts);
  ParsedMesh mesh{{}, counts.account, counts.last_digit};
  TriangleSoup& soup = mesh.soup;
  const std::size_t rest = bytes.size() - sizeof counts;
  if (counts.vertices > rest / sizeof(Vec3) || counts.triangles > rest / sizeof(soup.triangles[0]) ||
      counts.vertices * sizeof(Vec3) + counts.triangles * sizeof(soup.triangles[0]) != rest) {
    throw std::runtime_error("nothing that can be read");
  }
  soup.vertices.resize(counts.vertices);
  soup.triangles.resize(counts.triangles);
  for (std::size_t v = 0; v < soup.vertices.size(); ++v) {
    std::memcpy(soup.vertices[v].data(), bytes.data() + sizeof counts + v * sizeof(Vec3), sizeof(Vec3));
  }
  std::memcpy(soup.triangles.data(), bytes.data() + sizeof counts + counts.vertices * sizeof(Vec3),
              counts.triangles * sizeof(soup.triangles[0]));
  return mesh;
}

// Transforms the mesh from the file's unit and frame to W.
void place(TriangleSoup& soup, const MeshPlacement& placement) {
  using Anchor = MeshPlacement::Anchor;
  models::Pose pose = placement.pose_W;
  if (placement.anchor != Anchor::origin) {
    constexpr double infinity = std::numeric_limits<double>::infinity();
    models::Bounds box{Vec3::Constant(infinity), Vec3::Constant(-infinity)};
    for (const auto& triangle : soup.triangles) {
      for (const std::uint32_t v : triangle) {
        const Vec3 x = pose.linear() * Vec3(placement.scale * soup.vertices[v]);
        box = {box.low.cwiseMin(x), box.high.cwiseMax(x)};
      }
    }
    Vec3 at = 0.5 * (box.low + box.high);
    if (placement.anchor == Anchor::low) at.z() = box.low.z();
    pose.translation() -= at;
  }
  for (Vec3& x : soup.vertices) x = pose * Vec3(placement.scale * x);
}

// Returns the default welding distance, in the file's unit.
double weld_of(const ParsedMesh& mesh) {
  double largest = 0.0;
  for (const Vec3& x : mesh.soup.vertices) largest = std::max(largest, x.lpNorm<Eigen::Infinity>());
  return models::default_weld(largest, mesh.last_digit);
}

// Drops duplicate faces and, if the mesh isn't closed, welds its borders. Returns the given mesh if it doesn't change.
std::shared_ptr<const TriangleMesh> repaired(std::shared_ptr<const TriangleMesh> mesh, double weld_m,
                                             FaceAccount& account) {
  TriangleSoup soup{mesh->structure().vertices, mesh->structure().triangles};
  const auto leave_out = [&] {
    const models::RepeatedFaces repeated = models::leave_out_repeated(soup);
    account.repeated += repeated.same;
    account.double_sided += repeated.opposite;
    return repeated.same + repeated.opposite > 0;
  };
  const bool fewer = leave_out();
  models::WeldedCorners welded;
  if (fewer || !mesh->closed()) welded = models::weld_borders(soup, weld_m);
  if (!fewer && welded.corners == 0) return mesh;
  if (welded.corners > 0) {
    account.welded = welded.corners;
    account.collapsed = welded.collapsed;
    account.welded_within_m = weld_m;
    account.welded_apart_m = welded.apart_m;
    leave_out();
  }
  mesh = std::make_shared<const TriangleMesh>(std::move(soup));
  account.flat += mesh->dropped_triangles();
  return mesh;
}

}  // namespace

ParsedMesh parse_mesh_file(const std::filesystem::path& file) {
  const std::string extension = lower(file.extension().string());
  if (extension != ".stl" && extension != ".obj" && extension != ".ply") {
    throw SetupError({.file = file.string(),
                      .found = extension.empty() ? "a file without an extension" : in_quotes(extension),
                      .expected = "a mesh: .stl, .obj or .ply"});
  }
  // Ten times the time and memory that intact STL, OBJ and PLY files of this size need.
  const double megabytes = 1e-6 * static_cast<double>(checked_size(file));
  const SandboxLimits limits{.seconds = 2.0 + megabytes,
                             .memory = 1'000'000'000 + static_cast<std::size_t>(60e6 * megabytes)};
  try {
    return mesh_of(read_in_sandbox([&] { return bytes_of(parse(file, extension)); }, limits));
  } catch (const std::runtime_error& mistake) {
    throw SetupError({.file = file.string(), .found = mistake.what(), .expected = kExpected});
  }
}

TriangleSoup read_mesh_file(const std::filesystem::path& file) { return parse_mesh_file(file).soup; }

LoadedMesh load_mesh(const std::filesystem::path& file, const MeshPlacement& placement) {
  checked_size(file);
  const MeshCache cache(file, placement);
  try {
    if (auto cached = cache.load()) {
      return {std::make_shared<const TriangleMesh>(TriangleMesh::restored(std::move(cached->structure))),
              cached->account};
    }
    ParsedMesh parsed = parse_mesh_file(file);
    const double weld_m = placement.weld_m.value_or(placement.scale * weld_of(parsed));
    place(parsed.soup, placement);
    auto mesh = std::make_shared<const TriangleMesh>(std::move(parsed.soup));
    parsed.account.flat = mesh->dropped_triangles();
    mesh = repaired(std::move(mesh), weld_m, parsed.account);
    if (placement.close_holes_m > 0.0 && !mesh->closed()) {
      models::TriangleSoup filled = models::with_holes_closed(*mesh, placement.close_holes_m);
      parsed.account.closing = filled.triangles.size() - mesh->size();
      mesh = std::make_shared<const TriangleMesh>(std::move(filled));
    }
    cache.store({mesh->structure(), parsed.account});
    return {std::move(mesh), parsed.account};
  } catch (const std::invalid_argument& mistake) {
    throw SetupError({.file = file.string(), .message = mistake.what(), .advice = "check the mesh and its scale"});
  }
}

}  // namespace proxarm::scenes
