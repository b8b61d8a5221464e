// SHA-256 of all setpoints, as int32 little-endian counts in axis order, cycle after cycle. Two sessions have the same
// hash if their setpoints are equal.
//
// Not for the cycle: the reader of the records adds the setpoints.
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
  // Returns the hash of all counts so far as 64 lower-case hexadecimal digits. More counts may be added afterwards.
  [[nodiscard]] std::string hex() const;

 private:
  scenes::Sha256 hash_;
};

}  // namespace proxarm::controller
