// Runs `proxarm zero`: a session that only tares the sensor.
#pragma once

#include "controller/command_line/preparation/prepared_session.hpp"
#include "controller/command_line/preparation/zero_file.hpp"
#include "controller/supervision/fault.hpp"

namespace proxarm::command_line {

struct ZeroOutcome {
  controller::FaultReport fault;
  bool complete = false;
  ZeroFile zero;
};

// Both functions enable the drives, tare the sensor, and switch the drives off.
ZeroOutcome tare_simulated(const PreparedSession& session, const PreparedSession& arm, const RunOptions& options);
ZeroOutcome tare_on_interfaces(const PreparedSession& session, const RunOptions& options);

}  // namespace proxarm::command_line
