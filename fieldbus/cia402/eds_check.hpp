// Checks a drive's configuration against its EDS before any frame is sent: objects that are missing, have another size,
// or can't be written or mapped. Adds what the file requires: the drive's identity, and the values of a DCF.
#pragma once

#include <vector>

#include "fieldbus/canopen/canopen_pdo.hpp"
#include "fieldbus/canopen/canopen_sequence.hpp"
#include "models/description/cell.hpp"
#include "models/files/eds_file.hpp"

namespace proxarm::fieldbus {

// Objects that the drive lacks by its file.
struct EdsLosses {
  std::vector<std::string> missing;  // each with its effect, one line each
  std::string fixed;                 // objects that can't be written, separated by commas
};

// The file's default of 1000h if it is a CiA 402 drive (lower half 0192h).
[[nodiscard]] std::optional<std::uint32_t> cia402_device_type(const description::EdsFile& eds) noexcept;
// The steps without optional objects that the drive lacks, with its identity, and with a DCF's values at the end.
// Throws SetupError that names line and section of the EDS, or the cell's node if the DCF is another node's. Names in
// the result point into the file: `eds` must outlive it.
[[nodiscard]] std::vector<SdoStep> steps_by_eds(const std::vector<SdoStep>& steps, const description::EdsFile& eds,
                                                const description::DriveDescription& drive,
                                                EdsLosses* losses = nullptr);
// True if the drive's transmit PDO can carry this object. Throws as above if its size differs.
[[nodiscard]] bool can_send(const description::EdsFile& eds, const MappedObject& object);

}  // namespace proxarm::fieldbus
