// A drive's configuration held against its EDS, before anything is on the bus: objects that aren't there, of another
// size, that can't be written or mapped. And what the file adds: who the drive must say that it is, and what a DCF
// sets.
#pragma once

#include <vector>

#include "fieldbus/canopen/canopen_sequence.hpp"
#include "models/description/cell.hpp"
#include "models/files/eds_file.hpp"

namespace proxarm::fieldbus {

// The file's default of 1000h where that is a drive by CiA 402 (lower half 0192h).
[[nodiscard]] std::optional<std::uint32_t> cia402_device_type(const description::EdsFile& eds) noexcept;
// The steps without those for optional objects that the drive hasn't got, with its identity, and with a DCF's values at
// the end. Throws SetupError that names the EDS' line and section, or the cell's node where a DCF is another's. Names
// in the result are the file's: `eds` must outlive it.
[[nodiscard]] std::vector<SdoStep> steps_by_eds(const std::vector<SdoStep>& steps, const description::EdsFile& eds,
                                                const description::DriveDescription& drive);

}  // namespace proxarm::fieldbus
