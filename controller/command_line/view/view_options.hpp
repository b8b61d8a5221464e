// What `proxarm view` was asked to do.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "controller/command_line/view/headless_browser.hpp"

namespace proxarm::command_line {

struct ViewOptions {
  std::filesystem::path folder;  // of a record or a black box
  std::uint16_t port = 0;        // 0: any that is free

  // Pictures instead of a page that waits: of these times, in seconds of the record.
  std::vector<double> snapshots_s;
  std::filesystem::path out;  // of several with a number before the dot
  PictureSize size;
  bool dark = false;
  std::string look = "overview";
};

}  // namespace proxarm::command_line
