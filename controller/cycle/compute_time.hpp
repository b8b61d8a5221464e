// Adds the wall-clock time of a scope to a sum: what a cycle computes, without what it waits.
#pragma once

#include <chrono>
#include <cstdint>

namespace proxarm::controller {

class ComputeTime {
 public:
  explicit ComputeTime(std::int64_t& sum_ns) noexcept : sum_ns_(sum_ns), begun_(std::chrono::steady_clock::now()) {}
  ComputeTime(const ComputeTime&) = delete;
  ComputeTime& operator=(const ComputeTime&) = delete;
  ~ComputeTime() { sum_ns_ += std::chrono::nanoseconds(std::chrono::steady_clock::now() - begun_).count(); }

 private:
  std::int64_t& sum_ns_;
  std::chrono::steady_clock::time_point begun_;
};

}  // namespace proxarm::controller
