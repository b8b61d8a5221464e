#include "controller/command_line/preparation/data_files.hpp"

#include <cstdlib>

namespace proxarm::command_line {
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
  const fs::path where_installed = fs::path(PROXARM_INSTALLED_DATA) / relative;
  return !fs::exists(source, ignored) && fs::exists(where_installed, ignored) ? where_installed : source;
}

fs::path user_file(const fs::path& given) {
  std::error_code ignored;
  if (given.is_absolute() || fs::exists(given, ignored)) return given;
  const fs::path shipped = shipped_file(given.string());
  return fs::exists(shipped, ignored) ? shipped : given;
}

}  // namespace proxarm::command_line
