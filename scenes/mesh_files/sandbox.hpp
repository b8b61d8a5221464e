// Parses untrusted files in a sandbox: a child process with limits on its time and memory. A file that crashes its
// parser, keeps it busy for ever or makes it ask for all memory costs that process alone.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

namespace proxarm::scenes {

struct SandboxLimits {
  double seconds = 2.0;                // processor time; the wall clock allows three times as much
  std::size_t memory = 1'000'000'000;  // bytes beyond what the process has when it begins
};

// False under a sanitizer that reserves more addresses than a limit can hold.
extern const bool sandbox_limits_memory;

// Calls `read` in a child process and returns what it returns. Throws std::runtime_error if an exception of `read`
// (with its text), a limit or a signal ended the child, or if the system has no process to give.
std::vector<std::byte> read_in_sandbox(const std::function<std::vector<std::byte>()>& read,
                                       const SandboxLimits& limits);

}  // namespace proxarm::scenes
