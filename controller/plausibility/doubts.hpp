// Finds values in a session's files that are possible but probably not meant, such as a value in another unit, gravity
// upside down, or an inverted gear ratio. Each doubt is a line that begins with the file. Doubts aren't errors, since
// an arm may really be like that.
//
// The bounds are wider than the values of all arms, hands and scenes that are shipped here or made by `new-cell`. They
// are narrower than the ratios between units that people confuse.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "models/arm/arm.hpp"
#include "models/description/cell.hpp"
#include "models/description/hand.hpp"
#include "models/description/modbus_drive.hpp"
#include "scenes/format/scene.hpp"

namespace proxarm::controller {

// Precondition: `arm` is built from `cell`.
std::vector<std::string> cell_doubts(const description::Cell& cell, const models::Arm& arm);

// Register numbers of a map that look as if they were counted from 40001, as in manuals.
std::vector<std::string> register_doubts(const description::ModbusDriveDescription& drive);

// Where an arm's tool can be.
struct ToolReach {
  // The tool is never further than radius_m from the axis of a first joint that turns.
  struct FirstAxis {
    models::Vec3 through_W = models::Vec3::Zero(), direction_W = models::Vec3::UnitZ();
    double radius_m = 0.0;

    // Returns how far a point is beyond the tool's reach, m; negative within it.
    [[nodiscard]] double beyond_m(const models::Vec3& point_W) const noexcept;
  };
  models::Vec3 start_W = models::Vec3::Zero();  // the tool's place at the start
  double most_m = 0.0;                          // largest distance of any joint's axis from the tool, in any pose
  std::optional<FirstAxis> first_axis;          // empty if the first joint slides
};
ToolReach tool_reach(const models::Arm& arm);

// Without a reach, places aren't judged.
std::vector<std::string> hand_doubts(const description::HandDescription& hand, const std::optional<ToolReach>& reach);
std::vector<std::string> scene_doubts(const scenes::Scene& scene, const std::optional<ToolReach>& reach);

}  // namespace proxarm::controller
