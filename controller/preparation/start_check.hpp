// Checks whether a session can begin in the arm's start pose, before a bus is opened or a drive enabled.
#pragma once

#include <string>
#include <vector>

#include "controller/preparation/prepared_session.hpp"

namespace proxarm::controller {

// Checks files and options as `run` does before it opens a bus; `check` calls this function for a cell. The checks are
// require_usable_start(), require_enabling_switch(), require_stable() and, in simulation, require_carried(). Throws
// SetupError.
void require_runnable(const PreparedSession& session, const RunOptions& options);

// Returns a line of warning for each value that is valid but probably unintended: values that look like another unit
// (controller/plausibility/doubts.hpp), a simulated hand that pushes before the tare, doubtful meshes
// (scenes/mesh_files/mesh_report.hpp), a rigid tool longer than the arm, and a weight of the arm that takes too much of
// a drive's torque (controller/setpoints/held_weight.hpp).
std::vector<std::string> surprises(const PreparedSession& session);
void warn_of_surprises(const PreparedSession& session);  // prints these lines on standard error

// Throws SetupError if
// - the arm can't be built, for example because the URDF lacks a drive's joint;
// - the tool can't move straight in any direction;
// - the start pose is singular, inside an object of the scene, or too heavy for a drive;
// - the scene has dimensions in which the tool can't move.
void require_usable_start(const PreparedSession& session);

// Throws SetupError if `--enabling` is given without a simulated enabling switch.
void require_enabling_switch(const PreparedSession& session, const RunOptions& options);

// Throws SetupError if an option is given that is only for simulated arms. `arm` is the value of one such option: the
// simulated arm's cell. Precondition: the session is on interfaces.
void refuse_simulated_options(const RunOptions& options, const std::filesystem::path& arm);

// Throws SetupError if an option of the view is given without --view.
void require_view(const RunOptions& options);

// Throws SetupError if two drives on one interface have the same node number. `interfaces` has one interface for each
// bus of the cell.
void require_nodes_apart(const PreparedSession& session, const std::vector<std::string>& interfaces);

}  // namespace proxarm::controller
