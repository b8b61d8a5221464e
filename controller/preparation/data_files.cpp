#include "controller/preparation/data_files.hpp"

#include <cstdlib>

namespace proxarm::controller {
namespace fs = std::filesystem;

fs::path shipped_file(const std::string& relative) {
  std::error_code ignored;
  if (const char* set = std::getenv("PROXARM_DATA"); set != nullptr && *set != '\0') return fs::path(set) / relative;
  const fs::path executable = fs::read_symlink("/proc/self/exe", ignored);
  const fs::path installed = executable.parent_path().parent_path() / "share" / "proxarm" / relative;
  if (fs::exists(installed, ignored)) return installed;
  // A user's own program that links the installed libraries isn't beside share/proxarm, so it uses the path known at
  // build time.
  const fs::path source = fs::path(PROXARM_SOURCE_DIR) / relative;
  if (fs::exists(source, ignored)) return source;
  // Where `cmake --install` was configured to put them, and where Debian's packages do.
  for (const char* const data : {PROXARM_INSTALLED_DATA, "/usr/share/proxarm"}) {
    if (fs::exists(fs::path(data) / relative, ignored)) return fs::path(data) / relative;
  }
  return source;
}

fs::path user_file(const fs::path& given) {
  std::error_code ignored;
  if (given.is_absolute() || fs::exists(given, ignored)) return given;
  const fs::path shipped = shipped_file(given.string());
  return fs::exists(shipped, ignored) ? shipped : given;
}

}  // namespace proxarm::controller
