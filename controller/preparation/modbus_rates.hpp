// Reports the rates of Modbus lines before the arm moves, and warns if the loop with the hand isn't stable through axes
// that slow.
#pragma once

#include <string>

#include "controller/cycle/cycle.hpp"
#include "controller/preparation/prepared_session.hpp"

namespace proxarm::controller {

// Prints the measured rate of each drive on Modbus on standard error. If the loop with the hand isn't stable at the
// session's mass, also prints a warning with the arithmetic. Stability is judged as if all motion went through that
// drive's axis.
void report_modbus_rates(const PreparedSession& session, const CycleParts& parts);

// Returns the expected rate of the drive that reports its position least often, in 1/s; 0 if no drive is on Modbus.
double slowest_report_Hz(const description::Cell& cell);

// Returns a text with the expected rates on each Modbus line of the cell, with the arithmetic if the line is serial.
// Prints the warning of report_modbus_rates() on standard error, for the expected rates. Asks no device.
std::string modbus_plan_text(const PreparedSession& session);

// Returns a text with the address and the rate of a sensor on UDP; empty for any other sensor.
std::string udp_plan_text(const PreparedSession& session);

}  // namespace proxarm::controller
