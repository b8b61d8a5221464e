#include "controller/setpoint_hash.hpp"

#include <openssl/evp.h>

#include <array>
#include <cstddef>
#include <stdexcept>

namespace proxarm::controller {
namespace {

struct Free {
  void operator()(EVP_MD_CTX* context) const noexcept { EVP_MD_CTX_free(context); }
};
using ContextPointer = std::unique_ptr<EVP_MD_CTX, Free>;

void require(bool fine) {
  if (!fine) throw std::runtime_error("OpenSSL doesn't compute SHA-256 here");
}

}  // namespace

struct SetpointHash::Context {
  ContextPointer digest{EVP_MD_CTX_new()};
};

SetpointHash::SetpointHash() : context_(std::make_unique<Context>()) {
  require(context_->digest != nullptr && EVP_DigestInit_ex(context_->digest.get(), EVP_sha256(), nullptr) == 1);
}
SetpointHash::~SetpointHash() = default;
SetpointHash::SetpointHash(SetpointHash&&) noexcept = default;
SetpointHash& SetpointHash::operator=(SetpointHash&&) noexcept = default;

void SetpointHash::add(std::span<const std::int32_t> counts) {
  for (const std::int32_t count : counts) {
    const auto bits = static_cast<std::uint32_t>(count);
    const std::array<unsigned char, 4> bytes{static_cast<unsigned char>(bits), static_cast<unsigned char>(bits >> 8),
                                             static_cast<unsigned char>(bits >> 16),
                                             static_cast<unsigned char>(bits >> 24)};
    require(EVP_DigestUpdate(context_->digest.get(), bytes.data(), bytes.size()) == 1);
  }
}

std::string SetpointHash::hex() const {
  const ContextPointer copy{EVP_MD_CTX_new()};
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned int length = 0;
  require(copy != nullptr && EVP_MD_CTX_copy_ex(copy.get(), context_->digest.get()) == 1 &&
          EVP_DigestFinal_ex(copy.get(), digest.data(), &length) == 1);
  constexpr char digits[] = "0123456789abcdef";
  std::string text;
  for (unsigned int i = 0; i < length; ++i) {
    text += digits[digest[i] >> 4];
    text += digits[digest[i] & 15];
  }
  return text;
}

}  // namespace proxarm::controller
