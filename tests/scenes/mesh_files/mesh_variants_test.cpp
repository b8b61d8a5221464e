// The same shapes as assimp's exporters write them, which share no line with the reader: each comes back whole.
#include <assimp/scene.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <assimp/Exporter.hpp>
#include <string>
#include <vector>

#include "scenes/mesh_files/mesh_file.hpp"
#include "tests/models/mesh/mesh_shapes.hpp"
#include "tests/scenes/mesh_files/mesh_folder.hpp"

namespace proxarm::tests {
namespace {

using models::TriangleSoup;

// As assimp holds a scene: it deletes what it is given, with new[] and delete[] of its own.
aiScene* scene_of(const TriangleSoup& soup) {
  auto* mesh = new aiMesh;
  mesh->mNumVertices = static_cast<unsigned>(soup.vertices.size());
  mesh->mVertices = new aiVector3D[mesh->mNumVertices];
  for (unsigned v = 0; v < mesh->mNumVertices; ++v) {
    const models::Vec3& x = soup.vertices[v];
    mesh->mVertices[v] = {static_cast<float>(x.x()), static_cast<float>(x.y()), static_cast<float>(x.z())};
  }
  mesh->mPrimitiveTypes = aiPrimitiveType_TRIANGLE;
  mesh->mNumFaces = static_cast<unsigned>(soup.triangles.size());
  mesh->mFaces = new aiFace[mesh->mNumFaces];
  for (unsigned f = 0; f < mesh->mNumFaces; ++f) {
    const auto& triangle = soup.triangles[f];
    mesh->mFaces[f].mNumIndices = 3;
    mesh->mFaces[f].mIndices = new unsigned[3]{triangle[0], triangle[1], triangle[2]};
  }
  auto* scene = new aiScene;
  scene->mNumMeshes = 1;
  scene->mMeshes = new aiMesh* [1] { mesh };
  scene->mNumMaterials = 1;
  scene->mMaterials = new aiMaterial* [1] { new aiMaterial };
  scene->mRootNode = new aiNode("part");
  scene->mRootNode->mNumMeshes = 1;
  scene->mRootNode->mMeshes = new unsigned[1]{0};
  return scene;
}

class MeshVariants : public MeshFolder {};

TEST_F(MeshVariants, OfAnotherProgramAreReadWhole) {
  const std::vector<std::pair<std::string, TriangleSoup>> shapes{
      {"block", block({1, 2, 3})},
      {"ball", ball(2, 0.5)},
      {"globe", globe(9, 12, 0.3)},
      {"field", field(6, 1.0, [](double x, double y) { return 0.1 * x * y; })},
      {"one", {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}}}};
  int variants = 0;
  for (const auto& [name, soup] : shapes) {
    for (const auto& [format, extension] : {std::pair{"stl", ".stl"},
                                            {"stlb", ".stl"},
                                            {"obj", ".obj"},
                                            {"objnomtl", ".obj"},
                                            {"ply", ".ply"},
                                            {"plyb", ".ply"}}) {
      const auto file = folder / (name + "_" + format + extension);
      SCOPED_TRACE(file.string());
      aiScene* scene = scene_of(soup);
      Assimp::Exporter exporter;
      ASSERT_EQ(exporter.Export(scene, format, file.string()), aiReturn_SUCCESS) << exporter.GetErrorString();
      const scenes::LoadedMesh loaded = scenes::load_mesh(file, {});
      EXPECT_EQ(loaded.mesh->size(), soup.triangles.size());
      EXPECT_EQ(loaded.account.faces, soup.triangles.size());
      EXPECT_EQ(loaded.mesh->closed(), models::TriangleMesh(soup).closed());
      // Text has six digits or more of a coordinate below 1.5.
      const models::Bounds is = loaded.mesh->bounds(), was = models::TriangleMesh(soup).bounds();
      EXPECT_LE((is.high - was.high).norm() + (is.low - was.low).norm(), 1e-5);
      ++variants;
      delete scene;
    }
  }
  EXPECT_EQ(variants, 30);
}

}  // namespace
}  // namespace proxarm::tests
