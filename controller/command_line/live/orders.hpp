// The orders that a person may give to a running session, as text: "hold", "resume", "release", "back-off 20mm",
// "reset".
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "controller/supervision/command.hpp"

namespace proxarm::command_line {

const char* order_name(controller::Order order) noexcept;

// nullopt: the text isn't an order. Throws SetupError for an order with a bad value.
std::optional<controller::Command> parse_order(const std::string& text);

// Parses `--do`, ORDER@TIME, and sorts by time. Throws SetupError.
std::vector<controller::ScheduledCommand> scheduled_orders(const std::vector<std::string>& texts);

}  // namespace proxarm::command_line
