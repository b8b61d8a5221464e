// Whether a session can begin where the arm stands: before a bus is opened or a drive enabled.
#pragma once

#include <string>
#include <vector>

#include "controller/command_line/preparation/prepared_session.hpp"

namespace proxarm::command_line {

// All that `run` refuses of files and options before it opens a bus, and `check` of a cell with it: the three below,
// masses that aren't stable, and in simulation a timestep that a bus can't carry. Throws SetupError.
void require_runnable(const PreparedSession& session, const RunOptions& options);

// What isn't wrong but would surprise, a line each, told before anything is refused: what is hardly meant, such as a
// value in another unit (controller/plausibility/doubts.hpp), a simulated hand that pushes before the sensor is tared,
// of the scene's meshes (scenes/mesh_files/mesh_report.hpp), a rigid tool that is longer than the arm, and where the
// arm's weight takes all that setpoints may ask of a drive (controller/setpoints/held_weight.hpp).
std::vector<std::string> surprises(const PreparedSession& session);
void warn_of_surprises(const PreparedSession& session);  // on standard error

// Throws SetupError for an arm that can't be built (URDF without a drive's joint, and the like), for axes whose tool
// can't go straight in any direction, for a start pose in a singularity, from which the tool can't move in some
// direction, for one inside an object of the scene, for one in which the arm is too heavy for a drive, and for a scene
// in dimensions in which the tool can't move.
void require_usable_start(const PreparedSession& session);

// Throws SetupError where `--enabling` has no simulated enabling switch that it could press.
void require_enabling_switch(const PreparedSession& session, const RunOptions& options);

// Throws SetupError where an option of a simulated arm is given, one of them its cell, `arm`. Precondition: on
// interfaces.
void refuse_simulated_options(const RunOptions& options, const std::filesystem::path& arm);

// Throws SetupError where there are options of a view and none is wanted.
void require_view(const RunOptions& options);

// Which interface carries each bus, checked before any is opened: throws SetupError for two drives with one node.
void require_nodes_apart(const PreparedSession& session, const std::vector<std::string>& interfaces);

}  // namespace proxarm::command_line
