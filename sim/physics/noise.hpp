// Noise for simulated sensors. It depends only on a key, not on when or how often it is read.
#pragma once

#include <cstdint>

namespace proxarm::sim {

// splitmix64: mixes a counter so well that the noise of any sample can be computed without the samples before it.
inline std::uint64_t mixed(std::uint64_t x) noexcept {
  x += 0x9e3779b97f4a7c15ULL;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
  return x ^ (x >> 31);
}

// Returns an approximately standard normal number: the sum of 12 uniform numbers of 16 bits, each with a variance of
// 1/12 (relative error 2^-32). It uses no logarithms, so the result is equal to the bit on every machine. The values
// end at ±6; the kurtosis is 2.9.
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
