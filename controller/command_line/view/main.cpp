// The program behind `--view` and `proxarm view`: apart, so that nothing of a web server is in the memory of a session.
//
// Exit status: 0 fine, 2 set-up mistake.
#include <cstdlib>
#include <string>
#include <vector>

#include "controller/command_line/entry/program.hpp"
#include "controller/command_line/view/live_view.hpp"
#include "models/base/setup_error.hpp"

namespace {

using namespace proxarm;

int run(const std::vector<std::string>& words) {
  if (words.size() == 3 && words[0] == "live") {
    return command_line::live_view(std::atoi(words[1].c_str()), std::atoi(words[2].c_str()));
  }
  throw description::SetupError(
      {.found = "proxarm-view by itself", .expected = "proxarm, which starts it", .advice = "proxarm run --view"});
}

}  // namespace

int main(int argc, char** argv) {
  return command_line::run_program([&] { return run({argv + 1, argv + argc}); });
}
