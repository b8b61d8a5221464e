// Sessions of the default cell for the studies: in-process, in virtual time, nothing printed and nothing drawn.
#pragma once

#include "controller/studies/fidelity.hpp"
#include "controller/studies/skip.hpp"

namespace proxarm::command_line {

// Throws SetupError. Several threads may call it.
std::vector<studies::ArmSample> run_arm(const studies::ArmSetup& setup);
studies::CycleCounts count_cycles(const studies::CycleSetup& setup);

}  // namespace proxarm::command_line
