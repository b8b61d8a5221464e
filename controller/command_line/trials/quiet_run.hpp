// A session of the simulated arm, nothing printed and nothing drawn, of which each cycle is shown to somebody.
#pragma once

#include <functional>
#include <string>

#include "controller/command_line/preparation/prepared_session.hpp"
#include "controller/motion/motion_work.hpp"
#include "controller/record/cycle_record.hpp"
#include "controller/session/session.hpp"
#include "sim/cell/simulated_cell.hpp"

namespace proxarm::command_line {

using LookAtCycle = std::function<void(const controller::CycleRecord&, const sim::Truth&)>;

struct QuietEnd {
  controller::SessionEnd end = controller::SessionEnd::fault;
  std::string fault;            // its name; empty: none
  controller::MotionWork work;  // all zero where nothing is counted
};

// `look` sees each cycle's record, and the truth at its SYNC. Throws SetupError where the session can't begin. Several
// threads may call it.
QuietEnd run_quietly(const PreparedSession& session, const LookAtCycle& look);

}  // namespace proxarm::command_line
