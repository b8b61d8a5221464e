// Writes the configuration of a session, with every default filled in, as text for its record.
#pragma once

#include <string>

#include "controller/preparation/prepared_session.hpp"

namespace proxarm::controller {

std::string effective_config(const PreparedSession& session);

}  // namespace proxarm::controller
