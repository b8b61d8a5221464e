// A simulated drive with the object dictionary that its maker's EDS or DCF file describes.
//
// What the network finds is then the file's: which objects there are, their data types, who may access and map them,
// the values they start with and their limits. What the simulation does with an object stays what it is. An object of
// which it knows nothing is kept as it is written; one that it needs and the file hasn't got is hidden, and works on
// with the simulation's own default, as a firmware does that doesn't show it.
//
// Not from the file, because a drive is given it when it is built into a machine, or measures it: position limits
// (607Dh), rated torque (6076h), and whatever changes by itself, such as the statusword.
#pragma once

#include <cstdint>

#include "models/files/eds_file.hpp"
#include "sim/canopen/object_dictionary.hpp"

namespace proxarm::sim {

// Before the device's first power on. `node` is what $NODEID stands for.
void take_over(const description::EdsFile& eds, std::uint8_t node, ObjectDictionary& dictionary);

}  // namespace proxarm::sim
