// The options of `proxarm view`.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "controller/command_line/view/headless_browser.hpp"

namespace proxarm::command_line {

struct ViewOptions {
  std::filesystem::path folder;  // of a record or a black box
  std::uint16_t port = 0;        // 0: any free port

  // Pictures at these times of the record (s), instead of serving the page.
  std::vector<double> snapshots_s;
  std::filesystem::path out;  // several pictures get a number before the dot
  PictureSize size;
  bool dark = false;
  std::string look = "overview";
};

}  // namespace proxarm::command_line
