#include "controller/extras/view/program/page_files.hpp"

#include <cstdio>
#include <cstdlib>

#include "controller/drawing/palette.hpp"
#include "controller/preparation/data_files.hpp"
#include "models/base/setup_error.hpp"

namespace proxarm::command_line {

view::Assets page_files() {
  view::Assets assets;
  view::add_page(assets, controller::shipped_file("controller/extras/view/page"));
  const char* const elsewhere = std::getenv("PROXARM_THREE");
  view::add_three(assets, elsewhere != nullptr && *elsewhere != '\0' ? elsewhere : "/usr/share/javascript/three");
  assets["/palette.css"] = view::make_asset("text/css; charset=utf-8", controller::palette_css());
  return assets;
}

view::AssetPtr mesh_file(const view::Stage& stage, const std::string& path) {
  int link = -1;
  unsigned index = 0;
  if (std::sscanf(path.c_str(), "/mesh/object/%3u", &index) != 1 &&
      std::sscanf(path.c_str(), "/mesh/link/%3d/%3u", &link, &index) != 2) {
    return nullptr;
  }
  try {
    return std::make_shared<const view::Asset>(
        view::Asset{"application/octet-stream", stage.mesh_bytes(link, index), {}});
  } catch (const description::SetupError&) {
    return nullptr;  // the page draws everything else without this mesh
  }
}

}  // namespace proxarm::command_line
