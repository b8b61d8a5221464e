// How far proxy and tool are from the nearest surface, which only the scene knows and the cycle leaves out.
#pragma once

#include <cstdint>

#include "controller/record/cycle_record.hpp"
#include "scenes/format/scene.hpp"

namespace proxarm::controller {

// Sets both clearances of a record, after so much rendering. The tool is where the
// simulation's truth has it, else where the encoders do.
void add_clearances(CycleRecord& record, const scenes::Scene& scene, std::int64_t rendered_ns);

}  // namespace proxarm::controller
