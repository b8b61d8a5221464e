#include "controller/command_line/entry/standard_streams.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <iostream>

#include "controller/command_line/entry/exit_status.hpp"

namespace proxarm::command_line {

void open_standard_descriptors() noexcept {
  // open() returns the lowest free number. All descriptors below `descriptor` are open, so that number is `descriptor`.
  for (int descriptor = STDIN_FILENO; descriptor <= STDERR_FILENO; ++descriptor) {
    if (fcntl(descriptor, F_GETFD) != -1) continue;
    [[maybe_unused]] const int opened = open("/dev/null", descriptor == STDIN_FILENO ? O_WRONLY : O_RDONLY);
  }
}

int flush_standard_output(int status) noexcept {
  errno = 0;
  std::cout.flush();
  const bool lost = std::fflush(stdout) != 0 || std::ferror(stdout) != 0 || !std::cout;
  if (!lost) return status;
  if (errno == 0) {  // the write failed earlier; another one sets errno
    std::fputc('\n', stdout);
    std::fflush(stdout);
  }
  std::fprintf(stderr, "proxarm: standard output: %s; what was to be printed there is lost\n",
               errno != 0 ? std::strerror(errno) : "it couldn't be written to");
  return status == fine ? set_up_mistake : status;
}

}  // namespace proxarm::command_line
