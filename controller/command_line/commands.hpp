// The subcommands of proxarm; each returns the exit status and throws SetupError.
#pragma once

#include <filesystem>
#include <vector>

#include "controller/command_line/run_options.hpp"

namespace proxarm::command_line {

struct FileOptions {
  std::vector<std::filesystem::path> files;
};

int run_command(const RunOptions& options);
int sim_command(const RunOptions& options);
int plan_command(const RunOptions& options);
int check_command(const FileOptions& options);
int explain_command(const FileOptions& options);

}  // namespace proxarm::command_line
