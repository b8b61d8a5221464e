// Finds the files that come with proxarm. They are in the source tree during development, and in share/proxarm after
// installation.
#pragma once

#include <filesystem>
#include <string>

namespace proxarm::controller {

// Returns the place of a shipped file, given its path in the source tree, such as "models/cells/default.yaml". If the
// environment variable PROXARM_DATA is set, the file is in the folder that it names.
std::filesystem::path shipped_file(const std::string& relative);

// Returns the file that the user named: `given` if it exists, else the shipped file of that name. If neither exists,
// returns `given`, so that the loader's error message shows what the user wrote.
std::filesystem::path user_file(const std::filesystem::path& given);

}  // namespace proxarm::controller
