// A drive's configuration held against its EDS, before anything is on the bus: objects that aren't there, of another
// size, that can't be written or mapped. And what the file adds: who the drive must say that it is, and what a DCF
// sets.
#pragma once

#include <vector>

#include "fieldbus/canopen/canopen_pdo.hpp"
#include "fieldbus/canopen/canopen_sequence.hpp"
#include "models/description/cell.hpp"
#include "models/files/eds_file.hpp"

namespace proxarm::fieldbus {

// What the drive lacks, by its file.
struct EdsLosses {
  std::vector<std::string> missing;  // what is lost by it, a line each
  std::string fixed;                 // objects that can't be written, joined by commas
};

// The file's default of 1000h where that is a drive by CiA 402 (lower half 0192h).
[[nodiscard]] std::optional<std::uint32_t> cia402_device_type(const description::EdsFile& eds) noexcept;
// The steps without those for optional objects that the drive hasn't got, with its identity, and with a DCF's values at
// the end. Throws SetupError that names the EDS' line and section, or the cell's node where a DCF is another's. Names
// in the result are the file's: `eds` must outlive it.
[[nodiscard]] std::vector<SdoStep> steps_by_eds(const std::vector<SdoStep>& steps, const description::EdsFile& eds,
                                                const description::DriveDescription& drive,
                                                EdsLosses* losses = nullptr);
// Whether the drive has this object for its transmit PDO. Throws as above where it has it in another size.
[[nodiscard]] bool can_send(const description::EdsFile& eds, const MappedObject& object);

}  // namespace proxarm::fieldbus
