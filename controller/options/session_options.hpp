// Options that several commands share; each function adds some to `app`. Precondition: `options` outlives the parsing.
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <initializer_list>

#include "controller/preparation/run_options.hpp"

namespace proxarm::controller {

// Cell, scene, hand, the proxy's mass and what goes with it, timestep, duration and bus.
void add_session_options(CLI::App& app, RunOptions& options);
// Orientation, the tool's shape and its inertia.
void add_turning_options(CLI::App& app, RunOptions& options);
// Scripted faults of simulated devices.
void add_fault_option(CLI::App& app, RunOptions& options);
void add_arm_option(CLI::App& app, std::filesystem::path& arm);
void add_enabling_option(CLI::App& app, RunOptions& options);
void add_without_enabling(CLI::App& app, RunOptions& options);
void add_hardware_option(CLI::App& app, RunOptions& options);
void add_view_options(CLI::App& app, RunOptions& options, const char* what);

// Removes options from a command on which they would have no effect.
void leave_out(CLI::App& app, std::initializer_list<const char*> options);

}  // namespace proxarm::controller
