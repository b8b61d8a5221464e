// Where the files that come with proxarm are: in the source tree while building, in share/proxarm once installed.
#pragma once

#include <filesystem>
#include <string>

namespace proxarm::command_line {

// A file of ours by its path in the source tree ("models/cells/default.yaml"). PROXARM_DATA, where set, goes first.
std::filesystem::path shipped_file(const std::string& relative);

// A file that the user named: as given if it is there, else a shipped one of that name; else as given, so that the
// loader's message shows what the user wrote.
std::filesystem::path user_file(const std::filesystem::path& given);

}  // namespace proxarm::command_line
