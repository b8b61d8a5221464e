// Functions for the set-up of drives: SDO exchanges with several drives side by side, and NMT commands that the drives'
// heartbeats confirm. The functions block and are not for the cycle.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "fieldbus/cia402/cia402_bring_up.hpp"
#include "models/base/setup_error.hpp"

namespace proxarm::fieldbus {

using StepsOf = std::function<std::vector<SdoStep>(const ServoDrive&)>;

// Returns a handler that passes each drive the drive's frames, and all other frames to `other` (may be empty). The
// drives must outlive the handler.
[[nodiscard]] FrameHandler handed_to(std::span<const DriveSlot> drives, const FrameHandler& other = {});

// Runs an exchange with each drive until it is complete or has failed. Returns the results in the order of the drives.
// `handler` gets all frames that are no SDO answers of the drives. `boot_ups` gets, for each drive, its number of
// boot-up messages at its first answer; a later restart shows as a larger number.
[[nodiscard]] std::vector<SdoSequence> exchange(CanNetwork& network, std::span<const DriveSlot> drives,
                                                const FrameHandler& handler, const StepsOf& steps_of,
                                                std::vector<std::uint64_t>* boot_ups = nullptr);

// Sends the command to each drive. Throws SetupError if the command can't be sent.
void send_nmt(CanNetwork& network, std::span<const DriveSlot> drives, NmtCommand command, const char* name);

[[nodiscard]] std::int64_t longest_nmt_timeout_ns(std::span<const DriveSlot> drives) noexcept;

// True as soon as the heartbeats of all drives show `state`; false after `timeout_ns`.
[[nodiscard]] bool wait_for_state(CanNetwork& network, std::span<const DriveSlot> drives, const FrameHandler& handler,
                                  NmtState state, std::int64_t timeout_ns);

// Returns the error for a drive that isn't in the wanted state. `more` is appended to the state found.
[[nodiscard]] description::SetupError not_in_state(const ServoDrive& drive, NmtState wanted, const std::string& more,
                                                   const char* advice);

}  // namespace proxarm::fieldbus
