// Computes SHA-256 by OpenSSL, for the signatures of mesh caches and for the hash of a session's setpoints.
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <optional>
#include <span>

namespace proxarm::scenes {

class Sha256 {
 public:
  using Digest = std::array<unsigned char, 32>;

  Sha256();
  ~Sha256();
  Sha256(Sha256&&) noexcept;
  Sha256& operator=(Sha256&&) noexcept;

  void add(std::span<const std::byte> bytes) noexcept;
  // Returns the digest of the bytes so far; more bytes may follow. Returns nullopt if OpenSSL can't compute SHA-256 on
  // this machine.
  [[nodiscard]] std::optional<Digest> digest() const noexcept;

 private:
  struct Context;
  std::unique_ptr<Context> context_;
};

}  // namespace proxarm::scenes
