// `proxarm zero`: a session in which nothing but the sensor is tared.
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

// Enables the drives, tares the sensor, switches them off.
ZeroOutcome tare_simulated(const PreparedSession& session, const PreparedSession& arm, const RunOptions& options);
ZeroOutcome tare_on_interfaces(const PreparedSession& session, const RunOptions& options);

}  // namespace proxarm::command_line
