#include "scenes/mesh_files/mesh_file.hpp"

#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <assimp/BaseImporter.h>
#include <algorithm>
#include <array>
#include <assimp/Importer.hpp>
#include <cctype>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <system_error>
#include <vector>

#include "models/base/setup_error.hpp"
#include "scenes/mesh_files/mesh_cache.hpp"
#include "scenes/mesh_files/sandbox.hpp"

namespace proxarm::scenes {
namespace {

using description::in_quotes;
using description::SetupError;
using models::TriangleSoup;
using models::Vec3;

// Some five million triangles of a binary STL. The reader's limits of time and memory grow with the file.
constexpr std::uintmax_t most_bytes = std::uintmax_t{256} << 20;

constexpr const char* kExpected = "a mesh: STL, OBJ or PLY, with triangles";

std::string extension_of(const std::filesystem::path& file) {
  std::string extension = file.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension;
}

// Assimp believes a PLY file's header: it never stops looking for its end if there is none, and makes room for as many
// elements as it says, each of which takes a byte or more. Returns what is wrong with it; empty: nothing.
std::string mistake_in_ply_header(const std::filesystem::path& file, std::uintmax_t file_bytes) {
  std::ifstream in(file, std::ios::binary);
  std::string line;
  for (int k = 0; k < 10'000 && std::getline(in, line); ++k) {
    if (line.starts_with("end_header")) return "";
    std::istringstream words(line);
    std::string element, name, count;
    if (!(words >> element >> name >> count) || element != "element") continue;
    const bool is_number = count.find_first_not_of("0123456789") == std::string::npos;
    if (is_number && (count.size() > 18 || std::stoull(count) > file_bytes)) {
      return in_quotes(line) + " in a file of " + std::to_string(file_bytes) + " bytes";
    }
  }
  return "no end_header";
}

// The size of a file that is one, and of a size that may be read: a pipe would wait for ever.
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

// A file's extension decides on its format: Assimp's readers of all other formats are removed, so that no file reaches
// them.
void keep_reader_of(const std::string& extension, Assimp::Importer& importer) {
  const std::size_t wanted = importer.GetImporterIndex(extension.c_str());
  Assimp::BaseImporter* const keep = importer.GetImporter(wanted);
  for (std::size_t i = importer.GetImporterCount(); i-- > 0;) {
    if (Assimp::BaseImporter* const other = importer.GetImporter(i); other != keep) {
      importer.UnregisterLoader(other);
      delete other;
    }
  }
}

// Corrects the primitive types that Assimp states for each mesh, since its triangulation aborts the program where a
// mesh that is said to have polygons has none. False for faces without corners and for corners that aren't finite.
bool prepare_for_triangulation(const aiScene& scene) {
  for (unsigned m = 0; m < scene.mNumMeshes; ++m) {
    aiMesh& mesh = *scene.mMeshes[m];
    for (unsigned v = 0; v < mesh.mNumVertices; ++v) {
      const aiVector3D& x = mesh.mVertices[v];
      if (!std::isfinite(x.x) || !std::isfinite(x.y) || !std::isfinite(x.z)) return false;
    }
    constexpr std::array<unsigned, 5> type_of{aiPrimitiveType_POINT, aiPrimitiveType_POINT, aiPrimitiveType_LINE,
                                              aiPrimitiveType_TRIANGLE, aiPrimitiveType_POLYGON};
    if (mesh.mNumFaces == 0) return false;
    mesh.mPrimitiveTypes = 0;
    for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
      if (mesh.mFaces[f].mNumIndices == 0) return false;
      mesh.mPrimitiveTypes |= type_of[std::min(mesh.mFaces[f].mNumIndices, 4u)];
    }
  }
  return true;
}

// Parses a file by Assimp. Damaged files can crash it or keep it busy for ever, so this runs in a sandbox. Throws
// std::runtime_error with what was found.
TriangleSoup read_by_assimp(const std::filesystem::path& file, const std::string& extension) {
  Assimp::Importer importer;
  keep_reader_of(extension, importer);
  // Only positions and faces are kept, with node transforms applied. TriangleMesh merges equal vertices later, exactly.
  importer.SetPropertyInteger(AI_CONFIG_PP_RVC_FLAGS, aiComponent_NORMALS | aiComponent_TANGENTS_AND_BITANGENTS |
                                                          aiComponent_COLORS | aiComponent_TEXCOORDS |
                                                          aiComponent_TEXTURES | aiComponent_MATERIALS);
  const aiScene* scene = importer.ReadFile(file.string(), aiProcess_RemoveComponent);
  if (scene != nullptr && prepare_for_triangulation(*scene)) {
    scene = importer.ApplyPostProcessing(aiProcess_Triangulate | aiProcess_PreTransformVertices);
  } else {
    scene = nullptr;
  }
  if (scene == nullptr || scene->mNumMeshes == 0) {
    const std::string why = importer.GetErrorString();
    throw std::runtime_error(why.empty() ? "nothing that can be read" : in_quotes(why, 160));
  }
  TriangleSoup soup;
  for (unsigned m = 0; m < scene->mNumMeshes; ++m) {
    const aiMesh& mesh = *scene->mMeshes[m];
    const auto first = static_cast<std::uint32_t>(soup.vertices.size());
    soup.vertices.reserve(soup.vertices.size() + mesh.mNumVertices);
    for (unsigned v = 0; v < mesh.mNumVertices; ++v) {
      const aiVector3D& x = mesh.mVertices[v];
      soup.vertices.emplace_back(x.x, x.y, x.z);
    }
    for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
      const aiFace& face = mesh.mFaces[f];
      if (face.mNumIndices != 3) continue;
      for (unsigned k = 0; k < 3; ++k) {
        if (face.mIndices[k] >= mesh.mNumVertices) {
          throw std::runtime_error("vertex " + std::to_string(face.mIndices[k]) + " in face " + std::to_string(f) +
                                   " of a mesh of " + std::to_string(mesh.mNumVertices) + " vertices");
        }
      }
      soup.triangles.push_back({first + face.mIndices[0], first + face.mIndices[1], first + face.mIndices[2]});
    }
  }
  if (soup.triangles.empty()) {
    throw std::runtime_error("no triangles");
  }
  return soup;
}

// A soup as bytes, to pass it out of the sandbox.
std::vector<std::byte> bytes_of(const TriangleSoup& soup) {
  const std::array<std::uint64_t, 2> counts{soup.vertices.size(), soup.triangles.size()};
  const std::size_t vertices = soup.vertices.size() * sizeof(Vec3);
  const std::size_t triangles = soup.triangles.size() * sizeof(soup.triangles[0]);
  std::vector<std::byte> bytes(sizeof counts + vertices + triangles);
  std::memcpy(bytes.data(), counts.data(), sizeof counts);
  for (std::size_t v = 0; v < soup.vertices.size(); ++v) {
    std::memcpy(bytes.data() + sizeof counts + v * sizeof(Vec3), soup.vertices[v].data(), sizeof(Vec3));
  }
  std::memcpy(bytes.data() + sizeof counts + vertices, soup.triangles.data(), triangles);
  return bytes;
}

TriangleSoup soup_of(const std::vector<std::byte>& bytes) {
  std::array<std::uint64_t, 2> counts{};
  if (bytes.size() < sizeof counts) throw std::runtime_error("nothing that can be read");
  std::memcpy(counts.data(), bytes.data(), sizeof counts);
  TriangleSoup soup;
  const std::size_t rest = bytes.size() - sizeof counts;
  if (counts[0] > rest / sizeof(Vec3) || counts[1] > rest / sizeof(soup.triangles[0]) ||
      counts[0] * sizeof(Vec3) + counts[1] * sizeof(soup.triangles[0]) != rest) {
    throw std::runtime_error("nothing that can be read");
  }
  soup.vertices.resize(counts[0]);
  soup.triangles.resize(counts[1]);
  for (std::size_t v = 0; v < soup.vertices.size(); ++v) {
    std::memcpy(soup.vertices[v].data(), bytes.data() + sizeof counts + v * sizeof(Vec3), sizeof(Vec3));
  }
  std::memcpy(soup.triangles.data(), bytes.data() + sizeof counts + counts[0] * sizeof(Vec3),
              counts[1] * sizeof(soup.triangles[0]));
  return soup;
}

}  // namespace

TriangleSoup read_mesh_file(const std::filesystem::path& file) {
  const std::string extension = extension_of(file);
  if (extension != ".stl" && extension != ".obj" && extension != ".ply") {
    throw SetupError({.file = file.string(),
                      .found = extension.empty() ? "a file without an extension" : in_quotes(extension),
                      .expected = "a mesh: .stl, .obj or .ply"});
  }
  const std::uintmax_t bytes = checked_size(file);
  if (extension == ".ply") {
    const std::string found = mistake_in_ply_header(file, bytes);
    if (!found.empty()) throw SetupError({.file = file.string(), .found = found, .expected = kExpected});
  }
  // Ten times the time and the memory that STL, OBJ and PLY files of this size take.
  const double megabytes = 1e-6 * static_cast<double>(bytes);
  const SandboxLimits limits{.seconds = 2.0 + megabytes,
                             .memory = 1'000'000'000 + static_cast<std::size_t>(60e6 * megabytes)};
  try {
    return soup_of(read_in_sandbox([&] { return bytes_of(read_by_assimp(file, extension)); }, limits));
  } catch (const std::runtime_error& mistake) {
    throw SetupError({.file = file.string(), .found = mistake.what(), .expected = kExpected});
  }
}

std::shared_ptr<const models::TriangleMesh> load_mesh(const std::filesystem::path& file, double scale,
                                                      const models::Pose& pose_W) {
  checked_size(file);
  const MeshCache cache(file, scale, pose_W);
  try {
    if (auto structure = cache.load()) {
      return std::make_shared<const models::TriangleMesh>(models::TriangleMesh::restored(std::move(*structure)));
    }
    TriangleSoup soup = read_mesh_file(file);
    for (Vec3& x : soup.vertices) x = pose_W * Vec3(scale * x);
    auto mesh = std::make_shared<const models::TriangleMesh>(std::move(soup));
    cache.store(mesh->structure());
    return mesh;
  } catch (const std::invalid_argument& mistake) {
    throw SetupError({.file = file.string(), .message = mistake.what(), .advice = "check the mesh and its scale"});
  }
}

}  // namespace proxarm::scenes
