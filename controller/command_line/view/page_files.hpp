// The files of the page: its own and three.js, read once, and the meshes of what it shows.
#pragma once

#include <string>

#include "controller/view/stage/stage.hpp"
#include "controller/view/web/asset.hpp"

namespace proxarm::command_line {

// Throws SetupError if a file is missing.
view::Assets page_files();

// Returns a mesh by its path in Stage::describe(); null if there is none.
view::AssetPtr mesh_file(const view::Stage& stage, const std::string& path);

}  // namespace proxarm::command_line
