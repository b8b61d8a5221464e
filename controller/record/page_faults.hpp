// Counts the calling thread's page faults. Each costs a microsecond (minor) or, from a disk, milliseconds (major), so a
// cycle on time must have none. Locked memory (mlockall) has none.
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

// A system call.
inline PageFaults thread_page_faults() noexcept {
  rusage usage{};
  getrusage(RUSAGE_THREAD, &usage);
  return {usage.ru_minflt, usage.ru_majflt};
}

}  // namespace proxarm::controller
