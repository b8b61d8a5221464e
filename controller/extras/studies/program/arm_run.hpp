// Runs sessions of the default cell for the studies: in-process, in virtual time, without output.
#pragma once

#include "controller/extras/studies/fidelity.hpp"
#include "controller/extras/studies/skip.hpp"

namespace proxarm::command_line {

// Both functions throw SetupError, and may be called by several threads at once.
std::vector<studies::ArmSample> run_arm(const studies::ArmSetup& setup);
studies::CycleCounts count_cycles(const studies::CycleSetup& setup);

}  // namespace proxarm::command_line
