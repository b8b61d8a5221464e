// Finds the files that come with proxarm: in the source tree during development, in share/proxarm once installed.
#pragma once

#include <filesystem>
#include <string>

namespace proxarm::command_line {

// Returns a shipped file by its path in the source tree ("models/cells/default.yaml"). PROXARM_DATA, if set, has
// precedence.
std::filesystem::path shipped_file(const std::string& relative);

// Returns a file that the user named: `given` if it exists, else the shipped file of that name. If there is neither,
// returns `given`, so that the loader's message shows what the user wrote.
std::filesystem::path user_file(const std::filesystem::path& given);

}  // namespace proxarm::command_line
