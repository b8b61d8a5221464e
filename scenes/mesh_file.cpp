#include "scenes/mesh_file.hpp"

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
#include <stdexcept>
#include <string>
#include <system_error>
#include <vector>

#include "models/description/setup_error.hpp"
#include "scenes/apart.hpp"
#include "scenes/mesh_cache.hpp"

namespace proxarm::scenes {
namespace {

using description::in_quotes;
using description::SetupError;
using models::TriangleSoup;
using models::Vec3;

constexpr const char* kExpected = "a mesh: STL, OBJ or PLY, with triangles";

std::string extension_of(const std::filesystem::path& file) {
  std::string extension = file.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension;
}

// Assimp looks for the end of a PLY header for ever.
bool has_no_end_of_header(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::string line;
  for (int k = 0; k < 10'000 && std::getline(in, line); ++k) {
    if (line.starts_with("end_header")) return false;
  }
  return true;
}

// What a file is, its name says: none of the readers of other formats gets to see it.
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

// Assimp ends the program where a mesh that is said to have polygons has none. False: faces without corners, or corners
// that are no numbers.
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

// By assimp, which some damaged files end or keep for ever: in a process of its own. Throws std::runtime_error with
// what was found.
TriangleSoup read_by_assimp(const std::filesystem::path& file, const std::string& extension) {
  Assimp::Importer importer;
  keep_reader_of(extension, importer);
  // Only what a surface needs; node transforms are applied. Vertices are welded later, exactly.
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

// To and from the process that reads.
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
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error)) {
    throw SetupError({.file = file.string(), .found = "no such file", .expected = kExpected});
  }
  if (extension == ".ply" && has_no_end_of_header(file)) {
    throw SetupError({.file = file.string(), .found = "no end_header", .expected = kExpected});
  }
  // Ten times as long, and as much memory, as STL, OBJ and PLY files take.
  const double megabytes = 1e-6 * static_cast<double>(std::filesystem::file_size(file, error));
  const ReaderLimits limits{.seconds = 2.0 + megabytes,
                            .memory = 1'000'000'000 + static_cast<std::size_t>(60e6 * megabytes)};
  try {
    return soup_of(read_apart([&] { return bytes_of(read_by_assimp(file, extension)); }, limits));
  } catch (const std::runtime_error& mistake) {
    throw SetupError({.file = file.string(), .found = mistake.what(), .expected = kExpected});
  }
}

std::shared_ptr<const models::TriangleMesh> load_mesh(const std::filesystem::path& file, double scale,
                                                      const models::Pose& pose_W) {
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
