// Gives a simulated drive the object dictionary of its maker's EDS or DCF file.
//
// The file then determines objects, data types, access, mapping, default values and limits. The simulation's use of an
// object doesn't change. Objects unknown to the simulation are only stored. Objects that it needs but the file lacks
// are hidden and keep the simulation's default, as in a firmware that doesn't show them.
//
// Not taken from the file: values set at installation or measured. These are position limits (607Dh), rated torque
// (6076h), and values that change by themselves, such as the statusword.
#pragma once

#include <cstdint>

#include "models/files/eds_file.hpp"
#include "sim/canopen/object_dictionary.hpp"

namespace proxarm::sim {

// Call before the first power on. `node` replaces $NODEID.
void take_over(const description::EdsFile& eds, std::uint8_t node, ObjectDictionary& dictionary);

}  // namespace proxarm::sim
