// SHA-256, by OpenSSL: for the signatures of mesh caches here, and for the hash of a session's setpoints in controller.
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
  // Of what has been added so far; adding may go on. None where OpenSSL doesn't compute it here.
  [[nodiscard]] std::optional<Digest> digest() const noexcept;

 private:
  struct Context;
  std::unique_ptr<Context> context_;
};

}  // namespace proxarm::scenes
