// Counts the calling thread's page faults. A minor page fault costs a microsecond, a major one (from a disk)
// milliseconds. So a cycle that is to be on time may have no page fault; with locked memory (mlockall) there are none.
#pragma once

#include <sys/resource.h>

#include <cstdint>

namespace proxarm::controller {

struct PageFaults {
  std::int64_t minor = 0, major = 0;

  [[nodiscard]] PageFaults since(const PageFaults& before) const noexcept {
    return {minor - before.minor, major - before.major};
  }
};

// Returns the calling thread's page faults so far, by a system call.
inline PageFaults thread_page_faults() noexcept {
  rusage usage{};
  getrusage(RUSAGE_THREAD, &usage);
  return {usage.ru_minflt, usage.ru_majflt};
}

}  // namespace proxarm::controller
