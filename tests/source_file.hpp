// Where tests find the files that come with the project.
#pragma once

#include <filesystem>

namespace proxarm {

// The file or folder at this path of the source tree; its root without one.
std::filesystem::path source_file(const std::filesystem::path& path = {});

}  // namespace proxarm
