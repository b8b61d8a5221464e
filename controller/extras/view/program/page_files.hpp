// Provides the files of the page: the page's own files and three.js, which are read once, and the meshes that the page
// draws.
#pragma once

#include <string>

#include "controller/extras/view/web/asset.hpp"
#include "controller/stage/stage.hpp"

namespace proxarm::command_line {

// Reads the page's own files and three.js. Throws SetupError if a file is missing.
view::Assets page_files();

// Returns the mesh with this path in Stage::describe(); null if there is none.
view::AssetPtr mesh_file(const view::Stage& stage, const std::string& path);

}  // namespace proxarm::command_line
