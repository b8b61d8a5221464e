// Judges a prepared session: its timestep, mass, inertia, lookahead and virtual coupling.
#pragma once

#include "controller/preparation/prepared_session.hpp"

namespace proxarm::controller {

// Returns a problem that names what set the timestep: `--timestep`, or the key in the cell's file with its line. If the
// cell's file doesn't set the timestep, the problem has no line.
description::SetupProblem timestep_problem(const description::Cell& cell, const RunOptions& options);

// Throws SetupError if the handle alone is heavier than the requested mass, or if the loop with the hand would be
// unstable. In simulation, --force-unstable allows an unstable loop. For the impedance type, checks the stability of
// the virtual coupling instead.
void require_stable(const PreparedSession& session, const RunOptions& options);

// Throws SetupError if the tool may turn and its felt inertia isn't above the handle's own inertia, or is too large for
// a hand to turn.
void require_inertia_in_range(const PreparedSession& session);

// Throws SetupError for a timestep that no drive can hold exactly, or outside 0.05 to 100 ms.
void require_period(const PreparedSession& session, const RunOptions& options);

// Throws SetupError if an option removes what the cell's profile requires. The loader has already checked the cell
// itself.
void require_profile(const PreparedSession& session);

}  // namespace proxarm::controller
