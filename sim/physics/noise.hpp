// Noise of simulated sensors that depends on a key only: not on when, or how often, somebody asks.
#pragma once

#include <cstdint>

namespace proxarm::sim {

// splitmix64: a good mixer with a counter as its state, so that any sample's noise can be had without those before it.
inline std::uint64_t mixed(std::uint64_t x) noexcept {
  x += 0x9e3779b97f4a7c15ULL;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
  return x ^ (x >> 31);
}

// Close to a standard normal deviate: the sum of 12 uniform numbers of 16 bits, each with variance 1/12 (less 2^-32
// of it). No logarithms: the same bits on every machine. Ends at ±6, kurtosis 2.9.
inline double normal(std::uint64_t key) noexcept {
  std::int64_t sum = 0;
  for (std::uint64_t i = 0; i < 3; ++i) {
    const std::uint64_t bits = mixed(key + i);
    sum +=
        static_cast<std::int64_t>((bits & 0xffff) + ((bits >> 16) & 0xffff) + ((bits >> 32) & 0xffff) + (bits >> 48));
  }
  return (static_cast<double>(sum) - 12.0 * 32767.5) / 65536.0;
}

}  // namespace proxarm::sim
