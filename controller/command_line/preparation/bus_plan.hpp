// The frames of a session's cycle on each bus, and whether the buses can carry them.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "controller/command_line/preparation/prepared_session.hpp"
#include "controller/session/bring_up.hpp"
#include "fieldbus/budget/bus_budget.hpp"

namespace proxarm::command_line {

// One plan per bus of the network: buses of the cell that share an interface are one logical bus, with the lowest
// bitrate among them. `indices[i]` is where the cell's bus i is.
std::vector<fieldbus::BusPlan> plan_buses(const PreparedSession& session, const controller::BusIndices& indices);

// Throws SetupError with the arithmetic where a bus of the cell can't carry the timestep: in simulation each on a wire
// of its own, else on the interfaces of options.bus. It names who asked for that: the options or the cell.
void require_carried(const PreparedSession& session, const RunOptions& options);
// Whether that would be refused.
[[nodiscard]] bool is_carried(const PreparedSession& session);

using IsVirtual = std::function<bool(const std::string& interface)>;
bool is_virtual_interface(const std::string& interface);
// The same for buses on these interfaces, one for each of the cell's: two on one interface share its wire. Virtual ones
// have no bit timing, so of them it is a warning on standard error.
void require_carried_on(const std::vector<std::string>& interfaces, const PreparedSession& session,
                        const RunOptions& options, const IsVirtual& is_virtual = is_virtual_interface);

}  // namespace proxarm::command_line
