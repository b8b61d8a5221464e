// Counts what this test program takes from the heap, to hold hot paths to their promise.
#pragma once

#include <cstdint>

namespace proxarm::tests {

// Calls of malloc and its kin since the program started, all threads; operator new and Eigen's own allocator end there.
std::uint64_t allocation_count() noexcept;

// False under sanitizers, whose own malloc can't be replaced: such tests are skipped there.
bool allocations_are_counted() noexcept;

}  // namespace proxarm::tests
