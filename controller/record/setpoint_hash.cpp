#include "controller/record/setpoint_hash.hpp"

#include <array>
#include <cstddef>
#include <stdexcept>

namespace proxarm::controller {
namespace {

scenes::Sha256::Digest digest_of(const scenes::Sha256& hash) {
  const auto digest = hash.digest();
  if (!digest) throw std::runtime_error("OpenSSL doesn't compute SHA-256 here");
  return *digest;
}

}  // namespace

SetpointHash::SetpointHash() { digest_of(hash_); }

void SetpointHash::add(std::span<const std::int32_t> counts) {
  for (const std::int32_t count : counts) {
    const auto bits = static_cast<std::uint32_t>(count);
    const std::array bytes{static_cast<std::byte>(bits), static_cast<std::byte>(bits >> 8),
                           static_cast<std::byte>(bits >> 16), static_cast<std::byte>(bits >> 24)};
    hash_.add(bytes);
  }
}

std::string SetpointHash::hex() const {
  constexpr char digits[] = "0123456789abcdef";
  std::string text;
  for (const unsigned char byte : digest_of(hash_)) {
    text += digits[byte >> 4];
    text += digits[byte & 15];
  }
  return text;
}

}  // namespace proxarm::controller
