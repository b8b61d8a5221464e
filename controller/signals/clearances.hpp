// How far proxy and tool are from the nearest surface, which only the scene knows and the cycle leaves out.
#pragma once

#include <cstdint>

#include "controller/record/cycle_record.hpp"
#include "models/geometry/pose_algorithm.hpp"
#include "scenes/compiler/clearances.hpp"
#include "scenes/format/scene.hpp"

namespace proxarm::controller {

// Sets both clearances of a record, after so much rendering. The tool is where the
// simulation's truth has it, else where the encoders do. A point's contacts get their places, forces (place_contacts())
// and gaps, in an elastic layer from its surface, so below 0; the gap of an object that is driven stays 0, since the
// scene's file doesn't say where it is.
// Precondition: `clearances` are those of the scene.
void add_clearances(CycleRecord& record, const scenes::Scene& scene, const scenes::Clearances& clearances,
                    std::int64_t rendered_ns);

// The same of a rigid tool, by the poses of proxy and tool. Without the simulation's truth the tool is taken to have
// the proxy's orientation: the record has no other.
void add_clearances(CycleRecord& record, const models::PoseAlgorithm& rigid, std::int64_t rendered_ns);

}  // namespace proxarm::controller
