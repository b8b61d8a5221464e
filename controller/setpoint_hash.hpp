// One number for everything that was commanded: the SHA-256 of all setpoints, as int32 little-endian counts in axis
// order, cycle after cycle. Two runs that command the same have the same hash.
//
// Not for the cycle itself: whoever drains the records feeds it.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>

namespace proxarm::controller {

class SetpointHash {
 public:
  SetpointHash();
  ~SetpointHash();
  SetpointHash(SetpointHash&&) noexcept;
  SetpointHash& operator=(SetpointHash&&) noexcept;

  void add(std::span<const std::int32_t> counts);
  // 64 lower-case hexadecimal digits, of what has been added so far; adding may go on.
  [[nodiscard]] std::string hex() const;

 private:
  struct Context;
  std::unique_ptr<Context> context_;
};

}  // namespace proxarm::controller
