#include "controller/report/terminal.hpp"

#include <unistd.h>

#include <cstdlib>
#include <string_view>

namespace proxarm::controller {

bool can_redraw(std::FILE* stream) {
  const char* terminal = std::getenv("TERM");
  return isatty(fileno(stream)) == 1 && terminal != nullptr && std::string_view(terminal) != "dumb";
}

bool shows_colour(std::FILE* stream) {
  const char* refused = std::getenv("NO_COLOR");
  return (refused == nullptr || *refused == '\0') && can_redraw(stream);
}

}  // namespace proxarm::controller
