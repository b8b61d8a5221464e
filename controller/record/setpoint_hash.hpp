// SHA-256 of all setpoints, as int32 little-endian counts in axis order, cycle after cycle. Runs with the same
// setpoints have the same hash.
//
// Not for the cycle; the reader of the records feeds it.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "models/base/sha256.hpp"

namespace proxarm::controller {

class SetpointHash {
 public:
  // Throws std::runtime_error if OpenSSL can't compute SHA-256.
  SetpointHash();

  void add(std::span<const std::int32_t> counts);
  // 64 lower-case hexadecimal digits, over all counts so far; more may be added.
  [[nodiscard]] std::string hex() const;

 private:
  scenes::Sha256 hash_;
};

}  // namespace proxarm::controller
