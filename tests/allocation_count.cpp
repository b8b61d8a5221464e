#include "tests/allocation_count.hpp"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <memory>

#include "tests/sanitized.hpp"

namespace {
std::atomic<std::uint64_t> count{0};
}

#if defined(__GLIBC__) && !defined(PROXARM_SANITIZED_MALLOC)
#define PROXARM_COUNTS true
// glibc's own functions under other names, so that ours can stand before them.
extern "C" {
void* __libc_malloc(std::size_t);                 // NOLINT(bugprone-reserved-identifier,readability-identifier-naming)
void* __libc_calloc(std::size_t, std::size_t);    // NOLINT(bugprone-reserved-identifier,readability-identifier-naming)
void* __libc_realloc(void*, std::size_t);         // NOLINT(bugprone-reserved-identifier,readability-identifier-naming)
void* __libc_memalign(std::size_t, std::size_t);  // NOLINT(bugprone-reserved-identifier,readability-identifier-naming)

void* malloc(std::size_t size) {
  count.fetch_add(1, std::memory_order_relaxed);
  return __libc_malloc(size);
}
void* calloc(std::size_t n, std::size_t size) {
  count.fetch_add(1, std::memory_order_relaxed);
  return __libc_calloc(n, size);
}
void* realloc(void* memory, std::size_t size) {
  count.fetch_add(1, std::memory_order_relaxed);
  return __libc_realloc(memory, size);
}
void* memalign(std::size_t alignment, std::size_t size) {
  count.fetch_add(1, std::memory_order_relaxed);
  return __libc_memalign(alignment, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) { return memalign(alignment, size); }
int posix_memalign(void** memory, std::size_t alignment, std::size_t size) {
  *memory = memalign(alignment, size);
  return *memory == nullptr ? ENOMEM : 0;
}
}
#else
#define PROXARM_COUNTS false
#endif

namespace proxarm::tests {

std::uint64_t allocation_count() noexcept { return count.load(std::memory_order_relaxed); }
bool allocations_are_counted() noexcept { return PROXARM_COUNTS; }

TEST(AllocationCount, SeesAllocations) {
  if (!allocations_are_counted()) GTEST_SKIP() << "a sanitizer's malloc can't be counted";
  const std::uint64_t before = allocation_count();
  const auto held = std::make_unique<int>(1);
  EXPECT_EQ(allocation_count(), before + 1) << *held;
  const Eigen::VectorXd vector(100);
  EXPECT_EQ(allocation_count(), before + 2) << vector.size();
}

}  // namespace proxarm::tests
