// Checks a drive's configuration against its EDS before any frame is sent. It finds objects that are missing, have
// another size, or can't be written or mapped. It adds steps that the file requires: the check of the drive's identity,
// and the values of a DCF.
#pragma once

#include <vector>

#include "fieldbus/canopen/canopen_pdo.hpp"
#include "fieldbus/canopen/canopen_sequence.hpp"
#include "models/description/cell.hpp"
#include "models/files/eds_file.hpp"

namespace proxarm::fieldbus {

// What the drive loses according to its EDS.
struct EdsLosses {
  std::vector<std::string> missing;  // one line for each missing object, with its effect
  std::string fixed;                 // objects that can't be written but have a fitting default, separated by commas
};

// Returns the EDS's default of 1000h if it is that of a CiA 402 drive (lower half 0192h), else nullopt.
[[nodiscard]] std::optional<std::uint32_t> cia402_device_type(const description::EdsFile& eds) noexcept;
// Returns the steps, with these changes: optional objects that the drive lacks are left out, the drive's identity is
// checked, and the values of a DCF are written at the end. Throws SetupError that names line and section of the EDS. If
// the DCF is for another node, the error names the cell's node. Names in the result point into the file, so `eds` must
// outlive the result.
[[nodiscard]] std::vector<SdoStep> steps_by_eds(const std::vector<SdoStep>& steps, const description::EdsFile& eds,
                                                const description::DriveDescription& drive,
                                                EdsLosses* losses = nullptr);
// True if a transmit PDO of the drive can carry this object. Throws SetupError if the object has another size in the
// EDS.
[[nodiscard]] bool can_send(const description::EdsFile& eds, const MappedObject& object);

}  // namespace proxarm::fieldbus
