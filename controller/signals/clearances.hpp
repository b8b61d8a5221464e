// Computes the distances of proxy and tool to the nearest surface, which the cycle leaves out.
#pragma once

#include <cstdint>

#include "controller/record/cycle_record.hpp"
#include "models/geometry/pose_algorithm.hpp"
#include "scenes/compiler/clearances.hpp"
#include "scenes/format/scene.hpp"

namespace proxarm::controller {

// Sets both clearances of a record at this time of rendering, and the places, forces (place_contacts()) and gaps of a
// point's contacts. The tool's place is the simulation's true one if recorded, else by the encoders. Gaps are below 0
// in an elastic layer; a driven object's gap stays 0, since the scene's file doesn't say where it is. Precondition:
// `clearances` belong to `scene`.
void add_clearances(CycleRecord& record, const scenes::Scene& scene, const scenes::Clearances& clearances,
                    std::int64_t rendered_ns);

// The same for a rigid tool, by the poses of proxy and tool. Without the simulation's true pose, the tool is assumed to
// have the proxy's orientation, the only one in the record.
void add_clearances(CycleRecord& record, const models::PoseAlgorithm& rigid, std::int64_t rendered_ns);

}  // namespace proxarm::controller
