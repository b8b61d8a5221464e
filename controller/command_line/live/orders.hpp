// What a person may ask of a running session, as text: "hold", "resume", "release", "back-off 20mm", "reset".
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "controller/supervision/command.hpp"

namespace proxarm::command_line {

const char* order_name(controller::Order order) noexcept;

// Nothing: the text isn't one of them. Throws SetupError for one with a bad value.
std::optional<controller::Command> parse_order(const std::string& text);

// Of `--do`, ORDER@TIME, in the order of their times. Throws SetupError.
std::vector<controller::ScheduledCommand> scheduled_orders(const std::vector<std::string>& texts);

}  // namespace proxarm::command_line
