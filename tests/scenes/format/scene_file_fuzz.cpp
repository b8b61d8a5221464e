// libFuzzer: whatever bytes a scene's file holds, reading and compiling it gives a scene of finite numbers, or a
// SetupError of one line.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "models/base/setup_error.hpp"
#include "scenes/compiler/compile.hpp"
#include "scenes/format/scene_file.hpp"

namespace scenes = proxarm::scenes;

namespace {

// Meshes are files of their own, which no bytes here can be.
void read(std::string_view text) {
  const scenes::Scene scene = scenes::parse_scene(text, "/nowhere/fuzz.yaml");
  if (scene.coulomb_force_N && !std::isfinite(*scene.coulomb_force_N)) std::abort();
  for (const scenes::Object& object : scene.objects) {
    if (!std::isfinite(object.friction) || object.friction < 0.0) std::abort();
  }
  // One in eight: it takes several times as long as reading.
  if (text.size() % 8 == 0) (void)scenes::compile(scene);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    read({reinterpret_cast<const char*>(data), size});
  } catch (const proxarm::description::SetupError& error) {
    if (std::string_view(error.what()).find_first_of("\n\r\x1b") != std::string_view::npos) std::abort();
  }
  return 0;
}
