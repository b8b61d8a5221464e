// Finds values in a session's files that are possible but probably not meant, such as a value in another unit, gravity
// upside down, or an inverted gear ratio. Each doubt is a line that begins with the file. Doubts aren't errors, since
// an arm may really be like that.
//
// The bounds are wider than the values of all arms, hands and scenes that are shipped here or made by `new-cell`. They
// are narrower than the ratios between units that people confuse.
#pragma once

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

std::vector<std::string> hand_doubts(const description::HandDescription& hand);

// Register numbers of a map that look as if they were counted from 40001, as in manuals.
std::vector<std::string> register_doubts(const description::ModbusDriveDescription& drive);

// start_W: the tool's place at the start, m. reach_m: an upper bound of the distance of any of the arm's points from
// the arm's base.
std::vector<std::string> scene_doubts(const scenes::Scene& scene, const models::Vec3& start_W, double reach_m);

}  // namespace proxarm::controller
