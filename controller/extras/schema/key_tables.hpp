// Converts the model of a kind of file to Markdown tables that give each key's unit, default, range and meaning.
#pragma once

#include <string>

#include "controller/extras/schema/file_model.hpp"

namespace proxarm::command_line {

std::string key_tables(const MapModel& root, const std::string& kind);

}  // namespace proxarm::command_line
