// Reads the orders that a person may give to a running session: "hold", "resume", "release", "back-off 20mm", "reset".
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "controller/supervision/command.hpp"

namespace proxarm::controller {

const char* order_name(Order order) noexcept;

// Parses one order. Returns nullopt if the text isn't an order. Throws SetupError for an order with a bad value.
std::optional<Command> parse_order(const std::string& text);

// Parses the values of `--do`, each ORDER@TIME, and sorts them by time. Throws SetupError.
std::vector<ScheduledCommand> scheduled_orders(const std::vector<std::string>& texts);

}  // namespace proxarm::controller
