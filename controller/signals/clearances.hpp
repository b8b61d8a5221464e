// Computes the distances of proxy and tool to the nearest surface, and of contacts, which the cycle leaves out.
#pragma once

#include <cstdint>

#include "controller/record/cycle_record.hpp"
#include "models/geometry/pose_algorithm.hpp"
#include "scenes/compiler/clearances.hpp"
#include "scenes/format/scene.hpp"

namespace proxarm::controller {

// Sets both clearances of a record at this time of rendering. Sets place, force (place_contacts()) and gap of each
// contact of a point. The tool's place is the simulation's true one if recorded, else the place by the encoders. Gaps
// are below 0 in an elastic layer. The gap to a driven object stays 0, since the scene's file doesn't say where the
// object is. Precondition: `clearances` belong to `scene`.
void add_clearances(CycleRecord& record, const scenes::Scene& scene, const scenes::Clearances& clearances,
                    std::int64_t rendered_ns);

// Sets both clearances of a record with a rigid tool, from the poses of proxy and tool. If the simulation's true pose
// isn't recorded, the tool is assumed to have the proxy's orientation, the only orientation in the record.
void add_clearances(CycleRecord& record, const models::PoseAlgorithm& rigid, std::int64_t rendered_ns);

}  // namespace proxarm::controller
