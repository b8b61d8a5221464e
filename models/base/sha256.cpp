#include "models/base/sha256.hpp"

#include <openssl/evp.h>

namespace proxarm::scenes {

struct Sha256::Context {
  Context() noexcept { fine = digest != nullptr && EVP_DigestInit_ex(digest, EVP_sha256(), nullptr) == 1; }
  ~Context() { EVP_MD_CTX_free(digest); }
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;

  EVP_MD_CTX* digest = EVP_MD_CTX_new();
  bool fine = false;
};

Sha256::Sha256() : context_(std::make_unique<Context>()) {}
Sha256::~Sha256() = default;
Sha256::Sha256(Sha256&&) noexcept = default;
Sha256& Sha256::operator=(Sha256&&) noexcept = default;

void Sha256::add(std::span<const std::byte> bytes) noexcept {
  context_->fine = context_->fine && EVP_DigestUpdate(context_->digest, bytes.data(), bytes.size()) == 1;
}

std::optional<Sha256::Digest> Sha256::digest() const noexcept {
  const Context copy;
  Digest digest{};
  const bool fine = context_->fine && copy.fine && EVP_MD_CTX_copy_ex(copy.digest, context_->digest) == 1 &&
                    EVP_DigestFinal_ex(copy.digest, digest.data(), nullptr) == 1;
  return fine ? std::optional(digest) : std::nullopt;
}

}  // namespace proxarm::scenes
