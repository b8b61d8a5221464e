// Declares the options of `proxarm view`.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "controller/extras/view/program/headless_browser.hpp"

namespace proxarm::command_line {

struct ViewOptions {
  std::filesystem::path folder;  // folder of a record or a black box
  std::uint16_t port = 0;        // 0: any free port

  // Times of the record (s) at which pictures are taken; if any, the page isn't served to a user.
  std::vector<double> snapshots_s;
  std::filesystem::path out;  // the picture's file; several pictures get a number before the dot
  PictureSize size;
  bool dark = false;
  std::string look = "overview";
};

}  // namespace proxarm::command_line
