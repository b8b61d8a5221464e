// The files of the page, ours and three.js, read once.
#pragma once

#include "controller/view/web/asset.hpp"

namespace proxarm::command_line {

// Throws SetupError where something is missing.
view::Assets page_files();

}  // namespace proxarm::command_line
