// Declares the subcommands of proxarm. Each function returns the exit status and throws SetupError if a file, an option
// or the set-up is wrong.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "controller/preparation/run_options.hpp"
#include "scenes/compiler/check.hpp"

namespace proxarm::command_line {

struct FileOptions {
  std::vector<std::filesystem::path> files;
};

struct CheckFilesOptions {
  std::vector<std::filesystem::path> files;
  std::filesystem::path scene;  // with which cells are checked; empty: each cell's default scene
  scenes::CheckOptions states;  // how the laws of a scene are tried
};

struct SetOptions {
  std::vector<std::string> changes;
  std::filesystem::path control;
};

struct StatusOptions {
  std::filesystem::path control;
  bool watch = false;
  bool json = false;
};

struct ReplayOptions {
  std::filesystem::path folder;
  bool json = false;
};

struct SignalsOptions {
  std::filesystem::path folder;
  // Whether to print the table of contacts, or the frames, instead of the signals.
  bool contacts = false, frames = false;
};

struct ScanOptions {
  std::string interface;
  std::optional<std::uint32_t> sensor_base_id;
};

int run_command(const controller::RunOptions& options);
int sim_command(const controller::RunOptions& options);
int plan_command(const controller::RunOptions& options);
int scan_command(const ScanOptions& options);         // 1: no device answers
int replay_command(const ReplayOptions& options);     // 1: the setpoints differ
int signals_command(const SignalsOptions& options);   // prints a record as text
int set_command(const SetOptions& options);           // changes a running session
int status_command(const StatusOptions& options);     // shows a running session
int check_command(const CheckFilesOptions& options);  // 2: a file is wrong
int explain_command(const FileOptions& options);

}  // namespace proxarm::command_line
