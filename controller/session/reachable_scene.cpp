#include "controller/session/reachable_scene.hpp"

#include <utility>

#include "models/arm/arm.hpp"
#include "models/arm/tool_space.hpp"

namespace proxarm::controller {

scenes::Scene reachable_scene(scenes::Scene scene, const description::Cell& cell) {
  const bool empty = scene.objects.empty() && scene.media.empty() && !scene.coulomb_force_N && !scene.guide;
  if (!empty || scene.space.dimensions != 3 || cell.drives.size() >= 6) return scene;
  const models::Arm arm(cell);
  const models::ToolSpace reach = models::tool_space(arm);
  if (reach.dimensions == 0 || reach.dimensions == 3) return scene;
  scene.space = {
      .dimensions = reach.dimensions, .origin_m = arm.tool_pose(arm.start_rad()).translation(), .axes = reach.axes};
  return scene;
}

}  // namespace proxarm::controller
