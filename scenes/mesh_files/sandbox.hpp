// Parses untrusted files in a child process with limited time and memory. If a file crashes its parser, keeps it busy
// or makes it request too much memory, only the child ends.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

namespace proxarm::scenes {

struct SandboxLimits {
  double seconds = 2.0;                // processor time; the wall clock limit is three times this
  std::size_t memory = 1'000'000'000;  // bytes in addition to the process's memory at its start
};

// False with a sanitizer that reserves more addresses than a limit can hold.
extern const bool sandbox_limits_memory;

// Calls `read` in a child process and returns its result. Throws std::runtime_error if an exception of `read` (with its
// text), a limit or a signal ended the child, or if the system can't create a process.
std::vector<std::byte> read_in_sandbox(const std::function<std::vector<std::byte>()>& read,
                                       const SandboxLimits& limits);

}  // namespace proxarm::scenes
