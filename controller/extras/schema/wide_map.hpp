// Models maps of defaults. Such a map is in the file's root, and its keys apply to several other maps: drive_defaults,
// for example, applies to the maps in drives[].
#pragma once

#include "controller/extras/schema/file_model.hpp"

namespace proxarm::command_line {

// Gives each map of defaults, which is a key of the root whose comment says "(of PATH)", the keys of the maps at PATH,
// except the keys that the reader refuses in a map of defaults. No key is required in the map of defaults, and a key
// that depends on others accepts the values of all cases, because only the reader knows from where a map gets its keys.
// In a file that has a map of defaults, this also applies to the maps at PATH.
void share_keys(MapModel& root, const Specimens& specimens);

}  // namespace proxarm::command_line
