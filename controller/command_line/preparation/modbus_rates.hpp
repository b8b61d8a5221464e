// What Modbus lines achieve, shown before the motion, and whether a hand can be coupled through an axis that slow.
#pragma once

#include <string>

#include "controller/command_line/preparation/prepared_session.hpp"
#include "controller/cycle/cycle.hpp"

namespace proxarm::command_line {

// On standard error, a line per drive on Modbus with its measured rate, and a warning with the arithmetic where the
// loop with the hand, judged as if all of the motion went through that axis, has no margin at the mass that is wanted.
void report_modbus_rates(const PreparedSession& session, const controller::CycleParts& parts);

// The rate at which the joint that reports its position most seldom can be expected to, 1/s; 0: none is on Modbus.
double slowest_report_Hz(const description::Cell& cell);

// What can be expected of the cell's Modbus lines before anything is asked: a few lines each, with the arithmetic of
// serial ones. The same warning on standard error.
std::string modbus_plan_text(const PreparedSession& session);

}  // namespace proxarm::command_line
