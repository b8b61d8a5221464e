// Declares the subcommands of proxarm. Each function returns the exit status and throws SetupError if a file, an option
// or the set-up is wrong.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "controller/command_line/commissioning/calibrate_run.hpp"
#include "controller/command_line/preparation/run_options.hpp"
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

struct ProveOptions {
  RunOptions run;
  std::filesystem::path arm;  // cell of the simulated arm; empty: the controller's cell
  std::filesystem::path out;  // empty: beside the cell
  bool bus_loss = false;      // test only how the drives stop when the controller falls silent
};

struct ZeroOptions {
  RunOptions run;
  std::filesystem::path arm;  // cell of the simulated arm; empty: the controller's cell
  std::filesystem::path out;  // empty: beside the cell
};

struct IdentifyOptions {
  RunOptions run;
  std::filesystem::path arm;  // cell of the simulated arm; empty: the controller's cell
  // Identify friction, rotors and gears of the joints, instead of the load behind the sensor.
  bool joints = false;
  bool compare = false;  // compare the identified values with those in the cell and its zero file
  bool write = false;    // write the identified values into the cell and its zero file
};

struct AssessOptions {
  RunOptions run;
  std::filesystem::path thresholds;  // file of thresholds; empty: the shipped file
  int poses = 4;
};

struct SchemaOptions {
  std::string kind;       // cell, hand, scene, sensor, drive
  bool markdown = false;  // print tables of keys instead of a JSON Schema
};

int run_command(const RunOptions& options);
int sim_command(const RunOptions& options);
int plan_command(const RunOptions& options);
int scan_command(const ScanOptions& options);         // 1: no device answers
int replay_command(const ReplayOptions& options);     // 1: the setpoints differ
int signals_command(const SignalsOptions& options);   // prints a record as text
int set_command(const SetOptions& options);           // changes a running session
int status_command(const StatusOptions& options);     // shows a running session
int check_command(const CheckFilesOptions& options);  // 2: a file is wrong
int explain_command(const FileOptions& options);
int schema_command(const SchemaOptions& options);
int tune_command(const RunOptions& options);
int prove_command(const ProveOptions& options);               // 1: not proven
int zero_command(const ZeroOptions& options);                 // 1: the sensor wasn't tared
int identify_command(const IdentifyOptions& options);         // 1: not identified, or different from the cell
int identify_joints_command(const IdentifyOptions& options);  // 1: not identified, or different from the cell
int calibrate_command(const CalibrateOptions& options);       // 1: the poses don't fit one another
int assess_command(const AssessOptions& options);             // 1: a threshold is exceeded

}  // namespace proxarm::command_line
