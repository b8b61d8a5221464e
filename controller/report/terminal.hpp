// Finds out what a stream's terminal can do.
#pragma once

#include <cstdio>

namespace proxarm::controller {

// Returns whether `stream` is a terminal that can move its cursor.
bool can_redraw(std::FILE* stream);
// Returns whether the terminal shows colours and NO_COLOR isn't set (https://no-color.org).
bool shows_colour(std::FILE* stream);

}  // namespace proxarm::controller
