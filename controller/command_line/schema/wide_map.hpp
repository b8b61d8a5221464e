// Maps whose keys may stand once for all of them, in a map of the file's root: `drive_defaults` of `drives[]`.
#pragma once

#include "controller/command_line/schema/file_model.hpp"

namespace proxarm::command_line {

// Gives each key of the root that a specimen's comment calls "(of PATH)" the keys of the maps there, but for those that
// its reader refuses. None of them must be there, and what another key decides is left as wide as any case is: where a
// map has its keys from is known to the reader alone. The same goes for the maps themselves where such a key is there.
void share_keys(MapModel& root, const Specimens& specimens);

}  // namespace proxarm::command_line
