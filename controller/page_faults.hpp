// How often the kernel had to give the calling thread a page of memory: none while a cycle runs in time, since each
// costs it a microsecond (minor) or, from a disk, milliseconds (major). Locked memory (mlockall) has none.
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

// Of the calling thread so far. A system call.
inline PageFaults thread_page_faults() noexcept {
  rusage usage{};
  getrusage(RUSAGE_THREAD, &usage);
  return {usage.ru_minflt, usage.ru_majflt};
}

}  // namespace proxarm::controller
