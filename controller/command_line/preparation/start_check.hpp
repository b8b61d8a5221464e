// Checks whether a session can begin in the arm's start pose, before a bus is opened or a drive enabled.
#pragma once

#include <string>
#include <vector>

#include "controller/command_line/preparation/prepared_session.hpp"

namespace proxarm::command_line {

// Checks files and options as `run` does before it opens a bus; `check` uses it for a cell. Includes the three checks
// below, stable masses, and in simulation that the buses carry the timestep. Throws SetupError.
void require_runnable(const PreparedSession& session, const RunOptions& options);

// Returns a warning line for each valid but probably unintended value: values that look like another unit
// (controller/plausibility/doubts.hpp), a simulated hand that pushes before the tare, doubtful meshes
// (scenes/mesh_files/mesh_report.hpp), a rigid tool longer than the arm, and a weight that takes all the torque that
// setpoints may ask of a drive (controller/setpoints/held_weight.hpp).
std::vector<std::string> surprises(const PreparedSession& session);
void warn_of_surprises(const PreparedSession& session);  // on standard error

// Throws SetupError if
// - the arm can't be built, for example because the URDF lacks a drive's joint;
// - the tool can't move straight in any direction;
// - the start pose is singular, inside an object of the scene, or too heavy for a drive;
// - the scene has dimensions in which the tool can't move.
void require_usable_start(const PreparedSession& session);

// Throws SetupError if `--enabling` is given without a simulated enabling switch.
void require_enabling_switch(const PreparedSession& session, const RunOptions& options);

// Throws SetupError if an option of a simulated arm is given, among them its cell, `arm`. Precondition: the session is
// on interfaces.
void refuse_simulated_options(const RunOptions& options, const std::filesystem::path& arm);

// Throws SetupError if an option of the view is given without the view.
void require_view(const RunOptions& options);

// Throws SetupError if two drives on one interface have the same node number. `interfaces` has one for each bus of the
// cell.
void require_nodes_apart(const PreparedSession& session, const std::vector<std::string>& interfaces);

}  // namespace proxarm::command_line
