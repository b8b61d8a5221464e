// Gives a simulated drive the object dictionary of its maker's EDS or DCF file.
//
// The file then determines which objects exist, their data types, access types, mapping, default values and limits. The
// simulation uses an object in the same way as without a file. Objects that the simulation doesn't know are only
// stored. Objects that the simulation needs but the file lacks are hidden and keep the simulation's default, as in a
// firmware that doesn't show them.
//
// These values aren't taken from the file, because they are set at installation or measured: position limits (607Dh),
// rated torque (6076h), and values that change by themselves, such as the statusword.
#pragma once

#include <cstdint>

#include "models/files/eds_file.hpp"
#include "sim/canopen/object_dictionary.hpp"

namespace proxarm::sim {

// Applies the file to the dictionary. `node` replaces $NODEID. Must be called before the first power on.
void take_over(const description::EdsFile& eds, std::uint8_t node, ObjectDictionary& dictionary);

}  // namespace proxarm::sim
