// Counts calls of the global operator new in this test program, to hold hot paths to their promise.
#pragma once

#include <cstdint>

namespace proxarm::sim::testing {

std::uint64_t allocation_count() noexcept;  // since the program started, all threads

}  // namespace proxarm::sim::testing
