// Runs `proxarm zero`: a session that only tares the sensor.
#pragma once

#include "controller/preparation/prepared_session.hpp"
#include "controller/preparation/zero_file.hpp"
#include "controller/supervision/fault.hpp"

namespace proxarm::command_line {

struct ZeroOutcome {
  controller::FaultReport fault;
  bool complete = false;
  controller::ZeroFile zero;
};

// Both functions enable the drives, tare the sensor, and switch the drives off.
ZeroOutcome tare_simulated(const controller::PreparedSession& session, const controller::PreparedSession& arm,
                           const controller::RunOptions& options);
ZeroOutcome tare_on_interfaces(const controller::PreparedSession& session, const controller::RunOptions& options);

}  // namespace proxarm::command_line
