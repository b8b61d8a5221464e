// Maps of defaults: a map in the file's root whose keys apply to several maps, as `drive_defaults` for `drives[]`.
#pragma once

#include "controller/command_line/schema/file_model.hpp"

namespace proxarm::command_line {

// Gives each key of the root with "(of PATH)" in its comment the keys of the maps there, except those that its reader
// refuses. No key is required in it, and a key that depends on others accepts the values of all cases, because only the
// reader knows where a map gets its keys from. The same applies to the maps themselves while such a key is present.
void share_keys(MapModel& root, const Specimens& specimens);

}  // namespace proxarm::command_line
