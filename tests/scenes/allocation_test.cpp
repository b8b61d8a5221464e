// A step of any scene allocates nothing.
#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <filesystem>
#include <new>

#include "scenes/compile.hpp"
#include "scenes/scene_file.hpp"
#include "tests/models/random_states.hpp"

namespace {
std::atomic<std::uint64_t> allocations{0};
}  // namespace

void* operator new(std::size_t size) {
  allocations.fetch_add(1, std::memory_order_relaxed);
  if (void* memory = std::malloc(size == 0 ? 1 : size)) return memory;
  throw std::bad_alloc();
}
void* operator new[](std::size_t size) { return ::operator new(size); }
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete[](void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t) noexcept { std::free(memory); }

namespace proxarm::tests {
namespace {

using models::Vec3;

TEST(Compile, MakesStepsThatAllocateNothing) {
  for (const auto& entry : std::filesystem::directory_iterator(std::filesystem::path(PROXARM_SOURCE_DIR) / "scenes")) {
    if (entry.path().extension() != ".yaml") continue;
    const scenes::CompiledScene scene = scenes::compile(scenes::load_scene(entry.path()));
    if (scene.dimensions() != 3) continue;
    auto& g = scene.algorithm<3>();
    Random random(801);
    Vec3 q(0.7, 0, 0.6);
    std::size_t contacts = 0;
    const std::uint64_t before = allocations;
    for (int k = 1; k <= 20'000; ++k) {
      g.set_time({.time_s = 1e-3 * k, .period_s = 1e-3});
      const Vec3 p = q + random.log_uniform(1e-7, 0.1) * random.direction<3>() + 0.02 * (Vec3(0.75, 0, 0.6) - q);
      q = g(1e6, p, q);
      contacts += g.contacts().size();
    }
    EXPECT_EQ(allocations - before, 0u) << entry.path();
    EXPECT_TRUE(q.allFinite());
  }
}

}  // namespace
}  // namespace proxarm::tests
