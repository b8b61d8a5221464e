// What `proxarm-view` was asked to do.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace proxarm::command_line {

// Of any view.
struct ViewOptions {
  std::uint16_t port = 0;  // 0: any that is free
  std::vector<std::string> allowed_origins;
  bool open_browser = true;  // where there is a desktop
};

}  // namespace proxarm::command_line
