// One number for everything that was commanded: the SHA-256 of all setpoints, as int32 little-endian counts in axis
// order, cycle after cycle. Two runs that command the same have the same hash.
//
// Not for the cycle itself: whoever drains the records feeds it.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "models/base/sha256.hpp"

namespace proxarm::controller {

class SetpointHash {
 public:
  // Throws std::runtime_error where OpenSSL doesn't compute SHA-256.
  SetpointHash();

  void add(std::span<const std::int32_t> counts);
  // 64 lower-case hexadecimal digits, of what has been added so far; adding may go on.
  [[nodiscard]] std::string hex() const;

 private:
  scenes::Sha256 hash_;
};

}  // namespace proxarm::controller
