// Converts the model of a kind of file to a JSON Schema, draft 2020-12, with which editors complete and check YAML.
#pragma once

#include <string>
#include <vector>

#include "controller/extras/schema/file_model.hpp"
#include "models/files/json.hpp"

namespace proxarm::command_line {

description::Json schema_of(const std::vector<Alternative>& value);
description::Json schema_of(const MapModel& map);

description::Json schema_of_file(const MapModel& root, const std::string& kind);

}  // namespace proxarm::command_line
