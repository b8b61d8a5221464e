#include "models/packed/packed.hpp"

#include <zstd.h>

#include <stdexcept>

namespace proxarm::models {

std::string packed(std::string_view bytes) {
  constexpr int level = 1;
  std::string frame(ZSTD_compressBound(bytes.size()), '\0');
  const std::size_t size = ZSTD_compress(frame.data(), frame.size(), bytes.data(), bytes.size(), level);
  if (ZSTD_isError(size) != 0) throw std::runtime_error(ZSTD_getErrorName(size));  // out of memory
  frame.resize(size);
  return frame;
}

std::optional<std::string> unpacked(std::string_view frame, std::size_t bytes) {
  std::string out(bytes, '\0');
  const std::size_t size = ZSTD_decompress(out.data(), out.size(), frame.data(), frame.size());
  if (ZSTD_isError(size) != 0 || size != bytes) return std::nullopt;
  return out;
}

}  // namespace proxarm::models
