// What `proxarm view` was asked to do.
#pragma once

#include <cstdint>
#include <filesystem>

namespace proxarm::command_line {

struct ViewOptions {
  std::filesystem::path folder;  // of a record or a black box
  std::uint16_t port = 0;        // 0: any that is free
};

}  // namespace proxarm::command_line
