// Parses untrusted files in a child process with limited time and memory. If a file crashes its parser, keeps the
// parser busy or makes it request too much memory, only the child ends.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

namespace proxarm::scenes {

struct SandboxLimits {
  double seconds = 2.0;                // processor time; the limit of real time is three times as long
  std::size_t memory = 1'000'000'000;  // limit in bytes, in addition to the process's memory at its start
};

// False if a sanitizer is used that reserves more address space than a limit can express.
extern const bool sandbox_limits_memory;

// Calls `read` in a child process and returns its result. Throws std::runtime_error if `read` threw an exception (with
// its text), if a limit or a signal ended the child, or if the system can't create a process.
std::vector<std::byte> read_in_sandbox(const std::function<std::vector<std::byte>()>& read,
                                       const SandboxLimits& limits);

}  // namespace proxarm::scenes
