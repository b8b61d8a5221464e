#include "tests/fieldbus/allocation_count.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <memory>
#include <new>

namespace {
std::atomic<std::uint64_t> count{0};
}

void* operator new(std::size_t size) {
  count.fetch_add(1, std::memory_order_relaxed);
  if (void* memory = std::malloc(size == 0 ? 1 : size)) return memory;
  throw std::bad_alloc();
}
void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  count.fetch_add(1, std::memory_order_relaxed);
  return std::malloc(size == 0 ? 1 : size);
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete(void* memory, const std::nothrow_t&) noexcept { std::free(memory); }

namespace proxarm::fieldbus {

std::uint64_t allocation_count() noexcept { return count.load(std::memory_order_relaxed); }

TEST(AllocationCount, SeesAnAllocation) {
  const std::uint64_t before = allocation_count();
  const auto held = std::make_unique<int>(1);
  EXPECT_EQ(allocation_count(), before + 1) << *held;
}

}  // namespace proxarm::fieldbus
