// Queries the abilities of a stream's terminal.
#pragma once

#include <cstdio>

namespace proxarm::controller {

// Whether `stream` is a terminal that can move its cursor.
bool can_redraw(std::FILE* stream);
// Whether the terminal shows colours and NO_COLOR isn't set (https://no-color.org).
bool shows_colour(std::FILE* stream);

}  // namespace proxarm::controller
