// The files of the page: ours and three.js, read once, and the meshes of what it shows.
#pragma once

#include <string>

#include "controller/view/stage/stage.hpp"
#include "controller/view/web/asset.hpp"

namespace proxarm::command_line {

// Throws SetupError where something is missing.
view::Assets page_files();

// A mesh by the path that Stage::describe() gives it; null where there is none.
view::AssetPtr mesh_file(const view::Stage& stage, const std::string& path);

}  // namespace proxarm::command_line
