// Building blocks for the set-up of drives: SDO exchanges with several drives side by side, and NMT commands confirmed
// by heartbeats. Blocks; not for the cycle.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "fieldbus/cia402/cia402_bring_up.hpp"
#include "models/base/setup_error.hpp"

namespace proxarm::fieldbus {

using StepsOf = std::function<std::vector<SdoStep>(const ServoDrive&)>;

// A handler that gives each drive its frames, and `other` (may be empty) the rest. The drives must outlive it.
[[nodiscard]] FrameHandler handed_to(std::span<const DriveSlot> drives, const FrameHandler& other = {});

// Runs an exchange with each drive to its end, failed or not; results in the order of the drives. Frames other than SDO
// answers go to `handler`. `boot_ups` gets each drive's count at its first answer, to detect a later restart.
[[nodiscard]] std::vector<SdoSequence> exchange(CanNetwork& network, std::span<const DriveSlot> drives,
                                                const FrameHandler& handler, const StepsOf& steps_of,
                                                std::vector<std::uint64_t>* boot_ups = nullptr);

// Throws SetupError if the command can't be sent.
void send_nmt(CanNetwork& network, std::span<const DriveSlot> drives, NmtCommand command, const char* name);

[[nodiscard]] std::int64_t longest_nmt_timeout_ns(std::span<const DriveSlot> drives) noexcept;

// True as soon as the heartbeats of all drives show this state; false after `timeout_ns`.
[[nodiscard]] bool wait_for_state(CanNetwork& network, std::span<const DriveSlot> drives, const FrameHandler& handler,
                                  NmtState state, std::int64_t timeout_ns);

// The error for a drive that isn't in the wanted state; `more` is appended to the state found.
[[nodiscard]] description::SetupError not_in_state(const ServoDrive& drive, NmtState wanted, const std::string& more,
                                                   const char* advice);

}  // namespace proxarm::fieldbus
