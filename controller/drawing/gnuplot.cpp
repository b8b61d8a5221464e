#include "controller/drawing/gnuplot.hpp"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fstream>

extern char** environ;

namespace proxarm::controller {
namespace {

namespace fs = std::filesystem;

// A temporary folder, removed with its contents.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string name = (fs::temp_directory_path() / "proxarm_plot_XXXXXX").string();
    if (mkdtemp(name.data()) != nullptr) path_ = name;
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  ~TemporaryFolder() {
    std::error_code ignored;
    if (!path_.empty()) fs::remove_all(path_, ignored);
  }
  [[nodiscard]] const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

// Runs `program` with the script plot.gp of `folder`, without a shell. The output goes to the file "log" in `folder`.
// Returns an empty string on success, else a description of the problem.
std::string run(const std::string& program, const fs::path& folder) {
  const std::string script = (folder / "plot.gp").string(), log = (folder / "log").string();
  std::array<char*, 3> arguments{const_cast<char*>(program.c_str()), const_cast<char*>(script.c_str()), nullptr};
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, log.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0600);
  posix_spawn_file_actions_adddup2(&actions, STDOUT_FILENO, STDERR_FILENO);
  pid_t child = -1;
  const int error = posix_spawnp(&child, program.c_str(), &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (error == ENOENT) return program + " isn't installed (package gnuplot-nox)";
  if (error != 0) return program + " can't be started: " + std::strerror(error);
  int status = 0;
  while (waitpid(child, &status, 0) < 0) {
    if (errno != EINTR) return program + ": " + std::strerror(errno);
  }
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return "";
  if (WIFEXITED(status) && WEXITSTATUS(status) == 127) return program + " isn't installed (package gnuplot-nox)";
  std::ifstream said(log);
  std::string text, line;
  while (text.size() < 200 && std::getline(said, line)) {
    if (!line.empty()) text += (text.empty() ? "" : " ") + line;
  }
  return program + " failed: " + (text.empty() ? "without a word" : text);
}

}  // namespace

std::string gnuplot_string(const std::string& text) {
  std::string result = "'";
  for (const char c : text) {
    if (static_cast<unsigned char>(c) < 0x20) {
      result += ' ';
    } else {
      result += c;
      if (c == '\'') result += c;
    }
  }
  return result + "'";
}

std::string draw_svg(const std::string& gnuplot, const std::string& script, const std::string& data,
                     const fs::path& svg) {
  const std::string no_plot = "no plot: ";
  const TemporaryFolder folder;
  if (folder.path().empty()) return no_plot + "no temporary folder can be made";
  // The script changes to its own folder, so gnuplot reads and writes only there, and no outside name is in the script.
  std::ofstream(folder.path() / "data") << data;
  std::ofstream(folder.path() / "plot.gp") << "cd " << gnuplot_string(folder.path().string()) << "\n" << script;
  const std::string problem = run(gnuplot, folder.path());
  if (!problem.empty()) return no_plot + problem;
  std::error_code error;
  fs::copy_file(folder.path() / "plot.svg", svg, fs::copy_options::overwrite_existing, error);
  if (error) return no_plot + svg.string() + ": " + error.message();
  return "";
}

}  // namespace proxarm::controller
