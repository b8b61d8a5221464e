#include "controller/command_line/view/page_files.hpp"

#include <cstdlib>

#include "controller/command_line/preparation/data_files.hpp"

namespace proxarm::command_line {

view::Assets page_files() {
  view::Assets assets;
  view::add_page(assets, shipped_file("controller/view/page"));
  const char* const elsewhere = std::getenv("PROXARM_THREE");
  view::add_three(assets, elsewhere != nullptr && *elsewhere != '\0' ? elsewhere : "/usr/share/javascript/three");
  return assets;
}

}  // namespace proxarm::command_line
