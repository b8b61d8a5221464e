// Declares the commands of proxarm-commissioning. Each function returns the exit status and throws SetupError if a
// file, an option or the set-up is wrong.
#pragma once

#include <filesystem>
#include <string>

#include "controller/extras/commissioning/calibrate_run.hpp"
#include "controller/preparation/run_options.hpp"

namespace proxarm::command_line {

struct ProveOptions {
  controller::RunOptions run;
  std::filesystem::path arm;  // cell of the simulated arm; empty: the controller's cell
  std::filesystem::path out;  // empty: beside the cell
  bool bus_loss = false;      // test only how the drives stop when the controller falls silent
};

struct ZeroOptions {
  controller::RunOptions run;
  std::filesystem::path arm;  // cell of the simulated arm; empty: the controller's cell
  std::filesystem::path out;  // empty: beside the cell
};

struct IdentifyOptions {
  controller::RunOptions run;
  std::filesystem::path arm;  // cell of the simulated arm; empty: the controller's cell
  // Identify friction, rotors and gears of the joints, instead of the load behind the sensor.
  bool joints = false;
  bool compare = false;  // compare the identified values with those in the cell and its zero file
  bool write = false;    // write the identified values into the cell and its zero file
};

struct AssessOptions {
  controller::RunOptions run;
  std::filesystem::path thresholds;  // file of thresholds; empty: the shipped file
  int poses = 4;
};

struct SchemaOptions {
  std::string kind;       // cell, hand, scene, sensor, drive
  bool markdown = false;  // print tables of keys instead of a JSON Schema
};

int schema_command(const SchemaOptions& options);
int tune_command(const controller::RunOptions& options);
int prove_command(const ProveOptions& options);               // 1: not proven
int zero_command(const ZeroOptions& options);                 // 1: the sensor wasn't tared
int identify_command(const IdentifyOptions& options);         // 1: not identified, or different from the cell
int identify_joints_command(const IdentifyOptions& options);  // 1: not identified, or different from the cell
int calibrate_command(const CalibrateOptions& options);       // 1: the poses don't fit one another
int assess_command(const AssessOptions& options);             // 1: a threshold is exceeded

}  // namespace proxarm::command_line
