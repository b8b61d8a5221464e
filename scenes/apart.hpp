// Runs a reader of files of strangers in a process of its own, with limits: a file that ends its reader, keeps it for
// ever or wants all memory then costs that process alone.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

namespace proxarm::scenes {

struct ReaderLimits {
  double seconds = 2.0;                // of processor time; three times that on the clock
  std::size_t memory = 1'000'000'000;  // bytes, more than the process has when it begins
};

// Not under a sanitizer that reserves more addresses than a limit can hold.
extern const bool reader_memory_is_limited;

// What `read` returns, called in a child. Throws std::runtime_error with what ended it: an exception of `read` (its
// text), the limits, a signal. Where no process can be had, that is an error, too.
std::vector<std::byte> read_apart(const std::function<std::vector<std::byte>()>& read, const ReaderLimits& limits);

}  // namespace proxarm::scenes
