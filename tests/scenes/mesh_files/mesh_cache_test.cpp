// The cache beside a large mesh file.
#include <gtest/gtest.h>

#include <cstdlib>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <iostream>
#include <iterator>
#include <memory>
#include <string>
#include <vector>

#include "scenes/mesh_files/mesh_file.hpp"
#include "tests/models/mesh/mesh_shapes.hpp"
#include "tests/models/surfaces/random_states.hpp"
#include "tests/scenes/mesh_files/mesh_folder.hpp"

namespace proxarm::tests {
namespace {

using models::TriangleMesh;
using models::TriangleSoup;
using models::Vec3;

// Large enough to leave a cache beside it.
class MeshCache : public MeshFolder {
 protected:
  void SetUp() override {
    MeshFolder::SetUp();
    file = write("ball.stl", stl_of(ball(5, 0.5)));
    cache = file.string() + ".proxarm";
    fresh = load();
    ASSERT_TRUE(std::filesystem::is_regular_file(cache));
    bytes = text_of(cache);
  }
  std::shared_ptr<const TriangleMesh> load(double scale = 1.0) const {
    return scenes::load_mesh(file, {scale, models::Pose::Identity()}).mesh;
  }
  // A cache that isn't used is written again.
  bool is_used(double scale = 1.0) const {
    const std::filesystem::file_time_type long_ago{};
    std::filesystem::last_write_time(cache, long_ago);
    expect_same(*load(scale), scale);
    return std::filesystem::last_write_time(cache) == long_ago;
  }
  void expect_same(const TriangleMesh& mesh, double scale) const {
    const auto &a = mesh.structure(), &b = fresh->structure();
    ASSERT_EQ(a.triangles, b.triangles);
    ASSERT_EQ(a.nodes.size(), b.nodes.size());
    ASSERT_EQ(a.closed, b.closed);
    ASSERT_EQ(a.dropped, b.dropped);
    for (std::size_t i = 0; i < a.vertices.size(); ++i) ASSERT_EQ(a.vertices[i], scale * b.vertices[i]);
    if (scale == 1.0) {
      EXPECT_EQ(std::memcmp(a.nodes.data(), b.nodes.data(), a.nodes.size() * sizeof(a.nodes[0])), 0);
      EXPECT_EQ(mesh.bounds().high, fresh->bounds().high);
    }
  }

  std::filesystem::path file, cache;
  std::shared_ptr<const TriangleMesh> fresh;
  std::string bytes;
};

TEST_F(MeshCache, CountsForTheSameMeshOnly) {
  EXPECT_TRUE(is_used());
  EXPECT_FALSE(is_used(2.0)) << "another scale";
  EXPECT_TRUE(is_used(2.0));
  EXPECT_FALSE(is_used());
  std::string changed = text_of(file);
  changed[90] ^= 1;  // of the first triangle's normal, which counts for nothing: the same mesh, but other bytes
  write("ball.stl", changed);
  EXPECT_FALSE(is_used());
  EXPECT_TRUE(is_used());
  TriangleSoup moved = ball(5, 0.5);
  for (Vec3& x : moved.vertices) x.x() += 1.0;
  write("ball.stl", stl_of(moved));
  EXPECT_NEAR(load()->bounds().high.x(), 1.5, 1e-6);
}

TEST_F(MeshCache, IsIgnoredWhereItIsDamaged) {
  Random random(902);
  std::vector<std::string> damaged{"",
                                   "x",
                                   bytes.substr(0, 100),
                                   bytes.substr(0, bytes.size() - 1),
                                   bytes + "x",
                                   std::string(bytes.size(), '\xff'),
                                   std::string(bytes.size(), '\0')};
  for (int i = 0; i < 25; ++i) {
    std::string some = bytes;
    const double reach = random.chance(0.5) ? 100.0 : static_cast<double>(bytes.size());
    some[static_cast<std::size_t>(random.uniform(0.0, reach))] ^= static_cast<char>(1 << random.below(8));
    damaged.push_back(some);
  }
  for (const std::string& some : damaged) {
    write("ball.stl.proxarm", some);
    ASSERT_FALSE(is_used());
    ASSERT_EQ(text_of(cache), bytes) << "written again";
  }
}

TEST_F(MeshCache, OfAStrangerIsIgnored) {
  const auto key = folder / "cache/proxarm/mesh-key";
  const auto mode = std::filesystem::status(key).permissions();
  EXPECT_EQ(mode, std::filesystem::perms::owner_read | std::filesystem::perms::owner_write);
  std::filesystem::remove(key);
  EXPECT_FALSE(is_used()) << "signed with another secret";
  EXPECT_TRUE(is_used());
  // A secret that others can read is none.
  std::filesystem::permissions(key, std::filesystem::perms::group_read, std::filesystem::perm_options::add);
  std::filesystem::remove(cache);
  expect_same(*load(), 1.0);
  EXPECT_FALSE(std::filesystem::exists(cache));
}

TEST_F(MeshCache, IsDoneWithoutWhereItCannotBeWritten) {
  std::filesystem::remove(cache);
  std::filesystem::create_directory(cache);
  write("ball.stl.proxarm/in_the_way", "");
  expect_same(*load(), 1.0);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 3) << "nothing is left beside";
  std::filesystem::remove_all(cache);
  ::setenv("XDG_CACHE_HOME", file.c_str(), 1);  // no folder
  expect_same(*load(), 1.0);
  EXPECT_FALSE(std::filesystem::exists(cache));
}

TEST_F(MeshCache, MakesTheNextLoadQuickTiming) {
  file = write("large.stl", stl_of(ball(7, 0.5)));
  const auto seconds = [&] {
    const std::clock_t begun = std::clock();
    const auto mesh = load();
    const double taken = static_cast<double>(std::clock() - begun) / CLOCKS_PER_SEC;
    EXPECT_LE(mesh->bytes(), 150 * mesh->size());
    return taken;
  };
  const double first = seconds(), again = seconds();
  std::cout << "  328 k triangles: " << first << " s, again " << again << " s\n";
  EXPECT_LT(again, 0.4 * first);  // 0.12 on an idle machine
}

}  // namespace
}  // namespace proxarm::tests
