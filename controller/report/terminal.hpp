// What a stream's terminal can do.
#pragma once

#include <cstdio>

namespace proxarm::controller {

// Whether `stream` is a terminal that can move its cursor.
bool can_redraw(std::FILE* stream);
// Whether it shows colours and its user wants them: not with NO_COLOR set to anything (https://no-color.org).
bool shows_colour(std::FILE* stream);

}  // namespace proxarm::controller
