#include "models/packed/packed.hpp"

#include <zstd.h>

#include <memory>
#include <new>
#include <stdexcept>

namespace proxarm::models {

std::string packed(std::string_view bytes) {
  constexpr int level = 1;
  std::string frame(ZSTD_compressBound(bytes.size()), '\0');
  const std::size_t size = ZSTD_compress(frame.data(), frame.size(), bytes.data(), bytes.size(), level);
  if (ZSTD_isError(size) != 0) throw std::runtime_error(ZSTD_getErrorName(size));  // the library is out of memory
  frame.resize(size);
  return frame;
}

std::optional<std::string> unpacked(std::string_view frame, std::size_t bytes) {
  std::string out(bytes, '\0');
  const std::size_t size = ZSTD_decompress(out.data(), out.size(), frame.data(), frame.size());
  if (ZSTD_isError(size) != 0 || size != bytes) return std::nullopt;
  return out;
}

bool unpack(std::istream& frames, const std::function<bool(std::string_view)>& put) {
  const std::unique_ptr<ZSTD_DStream, decltype(&ZSTD_freeDStream)> stream(ZSTD_createDStream(), &ZSTD_freeDStream);
  if (!stream) throw std::bad_alloc();
  std::string in(ZSTD_DStreamInSize(), '\0'), out(ZSTD_DStreamOutSize(), '\0');
  do {
    frames.read(in.data(), static_cast<std::streamsize>(in.size()));
    ZSTD_inBuffer from{in.data(), static_cast<std::size_t>(frames.gcount()), 0};
    while (from.pos < from.size) {
      ZSTD_outBuffer to{out.data(), out.size(), 0};
      if (ZSTD_isError(ZSTD_decompressStream(stream.get(), &to, &from)) != 0) return false;
      if (!put({out.data(), to.pos})) return true;
    }
  } while (frames);
  return true;
}

}  // namespace proxarm::models
