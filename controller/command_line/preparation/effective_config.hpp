// Writes the configuration of a session, with every default filled in, as text for its record.
#pragma once

#include <string>

#include "controller/command_line/preparation/prepared_session.hpp"

namespace proxarm::command_line {

std::string effective_config(const PreparedSession& session);

}  // namespace proxarm::command_line
