// Counts calls of the global operator new in this test program, to hold hot paths to their promise.
#pragma once

#include <cstdint>

namespace proxarm::fieldbus {

std::uint64_t allocation_count() noexcept;  // since the program started, all threads

}  // namespace proxarm::fieldbus
