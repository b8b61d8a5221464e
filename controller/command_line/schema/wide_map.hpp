// Maps of defaults: a map in the file's root whose keys apply to several maps, as `drive_defaults` for `drives[]`.
#pragma once

#include "controller/command_line/schema/file_model.hpp"

namespace proxarm::command_line {

// Gives each key of the root whose comment says "(of PATH)" the keys of the maps there, except those that its reader
// refuses. No key is required in it, and dependent keys accept the values of all cases, because only the reader knows
// where a map gets its keys from. While such a key is present, the same applies to the maps themselves.
void share_keys(MapModel& root, const Specimens& specimens);

}  // namespace proxarm::command_line
