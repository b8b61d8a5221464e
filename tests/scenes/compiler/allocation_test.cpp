// A step of any scene allocates nothing.
#include <gtest/gtest.h>

#include <filesystem>

#include "scenes/compiler/compile.hpp"
#include "scenes/format/scene_file.hpp"
#include "tests/allocation_count.hpp"
#include "tests/models/surfaces/random_states.hpp"
#include "tests/source_file.hpp"

namespace proxarm::tests {
namespace {

using models::Vec3;

TEST(Compile, MakesStepsThatAllocateNothing) {
  if (!allocations_are_counted()) GTEST_SKIP() << "a sanitizer's malloc can't be counted";
  for (const auto& entry : std::filesystem::directory_iterator(source_file("scenes"))) {
    if (entry.path().extension() != ".yaml") continue;
    const scenes::CompiledScene scene = scenes::compile(scenes::load_scene(entry.path()));
    if (scene.dimensions() != 3) continue;
    auto& g = scene.algorithm<3>();
    Random random(801);
    Vec3 q(0.7, 0, 0.6);
    std::size_t contacts = 0;
    const std::uint64_t before = allocation_count();
    for (int k = 1; k <= 20'000; ++k) {
      g.set_time({.time_s = 1e-3 * k, .period_s = 1e-3});
      const Vec3 p = q + random.log_uniform(1e-7, 0.1) * random.direction<3>() + 0.02 * (Vec3(0.75, 0, 0.6) - q);
      q = g(1e6, p, q);
      contacts += g.contacts().size();
    }
    EXPECT_EQ(allocation_count() - before, 0u) << entry.path();
    EXPECT_TRUE(q.allFinite());
    EXPECT_TRUE(contacts > 0 || scene.plan.contacts == scenes::Plan::Contacts::none) << entry.path();
  }
}

}  // namespace
}  // namespace proxarm::tests
