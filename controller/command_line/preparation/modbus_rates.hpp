// Reports the rates of Modbus lines before the motion, and whether a hand can be coupled through such slow axes.
#pragma once

#include <string>

#include "controller/command_line/preparation/prepared_session.hpp"
#include "controller/cycle/cycle.hpp"

namespace proxarm::command_line {

// Prints the measured rate of each drive on Modbus on standard error. Also prints a warning with the arithmetic if the
// loop with the hand isn't stable at the wanted mass, judged as if all motion went through that axis.
void report_modbus_rates(const PreparedSession& session, const controller::CycleParts& parts);

// The expected rate of the joint that reports its position least often, 1/s; 0: no drive is on Modbus.
double slowest_report_Hz(const description::Cell& cell);

// Returns the expected rates of the cell's Modbus lines: a few lines of text each, with the arithmetic for serial
// lines. Prints the same warning on standard error. Asks no device.
std::string modbus_plan_text(const PreparedSession& session);

}  // namespace proxarm::command_line
