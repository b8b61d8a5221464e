// Plans the frames of a session's cycle on each bus, and checks whether the buses can carry them.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "controller/preparation/prepared_session.hpp"
#include "controller/session/bring_up.hpp"
#include "fieldbus/budget/bus_budget.hpp"

namespace proxarm::controller {

// Returns one plan per bus of the network. Buses of the cell that share an interface are one bus of the network, with
// the lowest of their bitrates. `indices[i]` is the network's bus for the cell's bus i.
std::vector<fieldbus::BusPlan> plan_buses(const PreparedSession& session, const BusIndices& indices);

// Throws SetupError with the arithmetic if a bus of the cell can't carry the timestep. In simulation each bus of the
// cell has its own wire; otherwise options.bus names the interfaces. The error names the option or the key of the cell
// that set the timestep.
void require_carried(const PreparedSession& session, const RunOptions& options);
// Returns whether each bus of the cell, on its own wire, can carry the timestep.
[[nodiscard]] bool is_carried(const PreparedSession& session);

using IsVirtual = std::function<bool(const std::string& interface)>;
bool is_virtual_interface(const std::string& interface);
// Throws SetupError if the buses on these interfaces can't carry the timestep. `interfaces` has one interface for each
// bus of the cell; buses on one interface share a wire. Virtual interfaces have no bit timing, so for them the function
// only warns on standard error.
void require_carried_on(const std::vector<std::string>& interfaces, const PreparedSession& session,
                        const RunOptions& options, const IsVirtual& is_virtual = is_virtual_interface);

}  // namespace proxarm::controller
