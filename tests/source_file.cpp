#include "tests/source_file.hpp"

namespace proxarm {

// Compiled in here alone, so that the same test in two checkouts is the same to a compiler cache.
std::filesystem::path source_file(const std::filesystem::path& path) {
  const std::filesystem::path root = PROXARM_SOURCE_DIR;
  return path.empty() ? root : root / path;
}

}  // namespace proxarm
