// What a session's files say that is possible and yet hardly meant: values in another unit, gravity upside down, a gear
// the wrong way round. A line each, beginning with the file; none of them is an error, since some arm may be so.
//
// The bounds are wider than what any arm, hand or scene shipped here or made by `new-cell` has, and narrower than the
// units that people mix up are apart.
#pragma once

#include <string>
#include <vector>

#include "models/arm/arm.hpp"
#include "models/description/cell.hpp"
#include "models/description/hand.hpp"
#include "models/description/modbus_drive.hpp"
#include "scenes/format/scene.hpp"

namespace proxarm::controller {

// Precondition: `arm` is the cell's.
std::vector<std::string> cell_doubts(const description::Cell& cell, const models::Arm& arm);

std::vector<std::string> hand_doubts(const description::HandDescription& hand);

// Of a register map: numbers that a manual counts from 40001.
std::vector<std::string> register_doubts(const description::ModbusDriveDescription& drive);

// start_W: where the tool is at the start, m. reach_m: how far no point of the arm is from its base.
std::vector<std::string> scene_doubts(const scenes::Scene& scene, const models::Vec3& start_W, double reach_m);

}  // namespace proxarm::controller
