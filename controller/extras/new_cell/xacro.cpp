#include "controller/extras/new_cell/xacro.hpp"

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <optional>
#include <sstream>

#include "models/base/setup_error.hpp"

namespace proxarm::command_line {
namespace {

namespace fs = std::filesystem;
using description::in_quotes;
using description::SetupError;

constexpr std::size_t most_bytes = std::size_t{16} << 20;

// Returns the name of the package in this folder; empty if the folder isn't a package's.
std::string package_in(const fs::path& folder) {
  std::ifstream in(folder / "package.xml");
  if (!in) return "";
  const std::string text{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  const std::size_t begin = text.find("<name>"), end = text.find("</name>");
  if (begin == std::string::npos || end == std::string::npos || end < begin + 6) return folder.filename().string();
  std::istringstream name(text.substr(begin + 6, end - begin - 6));
  std::string word;
  name >> word;
  return word;
}

std::vector<fs::path> folders_in(const char* variable) {
  std::vector<fs::path> folders;
  const char* value = std::getenv(variable);
  std::istringstream in(value != nullptr ? value : "");
  for (std::string one; std::getline(in, one, ':');) {
    if (!one.empty()) folders.emplace_back(one);
  }
  return folders;
}

// A temporary folder in which ROS 2 finds the packages. The destructor removes the folder.
class PackageIndex {
 public:
  explicit PackageIndex(const Packages& packages) {
    std::string name = (fs::temp_directory_path() / "proxarm-packages-XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr) throw SetupError({.message = "no temporary folder: " + name});
    folder_ = name;
    const fs::path index = folder_ / "share/ament_index/resource_index/packages";
    fs::create_directories(index);
    for (const auto& [package, place] : packages.all()) {
      std::ofstream{index / package};
      std::error_code ignored;
      fs::create_directory_symlink(fs::absolute(place), folder_ / "share" / package, ignored);
    }
  }
  PackageIndex(const PackageIndex&) = delete;
  PackageIndex& operator=(const PackageIndex&) = delete;
  ~PackageIndex() {
    std::error_code ignored;
    fs::remove_all(folder_, ignored);  // removes the links in it, not their targets
  }
  [[nodiscard]] const fs::path& folder() const noexcept { return folder_; }

 private:
  fs::path folder_;
};

void prepend(const char* variable, const std::string& value) {
  const char* old = std::getenv(variable);
  ::setenv(variable, (value + (old != nullptr && *old != '\0' ? ":" + std::string(old) : "")).c_str(), 1);
}

// Replaces the child process by xacro. Its standard output goes to `out`, and its standard error to the file `errors`.
[[noreturn]] void become_xacro(const std::vector<std::string>& words, int out, const fs::path& errors) {
  ::dup2(out, STDOUT_FILENO);
  const int said = ::open(errors.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
  if (said >= 0) ::dup2(said, STDERR_FILENO);
  std::vector<char*> argv;
  argv.reserve(words.size() + 1);
  for (const std::string& word : words) argv.push_back(const_cast<char*>(word.c_str()));
  argv.push_back(nullptr);
  ::execvp(argv[0], argv.data());
  ::_exit(127);
}

std::string all_of(int fd) {
  std::string text;
  std::array<char, 65536> some{};
  for (ssize_t n = 0; (n = ::read(fd, some.data(), some.size())) != 0;) {
    if (n < 0 && errno == EINTR) continue;
    if (n < 0 || text.size() > most_bytes) break;
    text.append(some.data(), static_cast<std::size_t>(n));
  }
  return text;
}

std::string contents_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

}  // namespace

Packages::Packages(const std::vector<std::string>& given, const fs::path& urdf) {
  std::error_code error;
  // A later entry replaces an earlier entry of the same name. First come the packages beside the URDF's package, then
  // those of the environment, then those of --package.
  for (fs::path folder = fs::absolute(urdf).parent_path(); folder.has_relative_path(); folder = folder.parent_path()) {
    if (!fs::exists(folder / "package.xml", error)) continue;
    for (const auto& beside : fs::directory_iterator(folder.parent_path(), error)) {
      if (const std::string name = package_in(beside.path()); !name.empty()) known_[name] = beside.path();
    }
    break;
  }
  for (const fs::path& prefix : folders_in("AMENT_PREFIX_PATH")) {
    for (const auto& one : fs::directory_iterator(prefix / "share", error)) {
      if (const std::string name = package_in(one.path()); !name.empty()) known_[name] = one.path();
    }
  }
  for (const fs::path& above : folders_in("ROS_PACKAGE_PATH")) {
    if (const std::string name = package_in(above); !name.empty()) known_[name] = above;
    for (const auto& one : fs::directory_iterator(above, error)) {
      if (const std::string name = package_in(one.path()); !name.empty()) known_[name] = one.path();
    }
  }
  for (const std::string& word : given) {
    const std::size_t equals = word.find('=');
    const fs::path place = equals == std::string::npos ? fs::path() : fs::path(word.substr(equals + 1));
    if (equals == 0 || place.empty() || !fs::is_directory(place, error)) {
      throw SetupError(
          {.key = "--package", .found = in_quotes(word), .expected = "NAME=DIR, of a folder that is there"});
    }
    known_[word.substr(0, equals)] = place;
  }
}

fs::path Packages::folder(const std::string& name) const {
  const auto found = known_.find(name);
  return found != known_.end() ? found->second : fs::path();
}

std::string urdf_text(const fs::path& file, const std::vector<std::string>& arguments, const Packages& packages) {
  std::error_code error;
  if (!fs::is_regular_file(file, error)) {
    throw SetupError({.file = file.string(), .found = "no such file", .expected = "an arm's .urdf or .xacro"});
  }
  if (fs::file_size(file, error) > most_bytes) {
    throw SetupError({.file = file.string(), .found = "more than 16 MiB", .expected = "a URDF"});
  }
  if (file.extension() != ".xacro") return contents_of(file);
  const PackageIndex index(packages);
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) throw SetupError({.message = "no pipe for xacro"});
  const fs::path errors = index.folder() / "said";
  std::vector<std::string> words{"xacro", file.string()};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::string paths;
  for (const auto& [name, place] : packages.all()) paths += (paths.empty() ? "" : ":") + fs::absolute(place).string();
  prepend("ROS_PACKAGE_PATH", paths);
  prepend("AMENT_PREFIX_PATH", index.folder().string());
  const pid_t child = ::fork();
  if (child == 0) become_xacro(words, ends[1], errors);
  ::close(ends[1]);
  const std::string text = all_of(ends[0]);
  ::close(ends[0]);
  int status = 0;
  while (child > 0 && ::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (child > 0 && WIFEXITED(status) && WEXITSTATUS(status) == 0) return text;
  if (child > 0 && WIFEXITED(status) && WEXITSTATUS(status) == 127) {
    throw SetupError({.file = file.string(),
                      .found = "a xacro, and no program xacro on the path that expands it (Debian 12 has none)",
                      .expected = "a URDF",
                      .advice = "`xacro " + file.filename().string() + " > arm.urdf` makes one where ROS is"});
  }
  std::string said = contents_of(errors);
  while (!said.empty() && said.back() == '\n') said.pop_back();
  throw SetupError({.file = file.string(),
                    .message = "xacro refuses it",
                    .found = in_quotes(said.substr(said.rfind('\n') + 1), 300),
                    .advice = "--package NAME=DIR for packages, NAME:=VALUE behind the file for its arguments"});
}

}  // namespace proxarm::command_line
