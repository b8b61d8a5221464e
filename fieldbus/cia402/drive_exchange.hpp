// What the set-up of drives is made of: SDO exchanges with several of them side by side, and NMT commands that show in
// their heartbeats. Blocks; not for the cycle.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "fieldbus/cia402/cia402_bring_up.hpp"
#include "models/base/setup_error.hpp"

namespace proxarm::fieldbus {

using StepsOf = std::function<std::vector<SdoStep>(const ServoDrive&)>;

// Each drive's own frames to it; `other` (may be empty) gets the rest. The drives must outlive it.
[[nodiscard]] FrameHandler handed_to(std::span<const DriveSlot> drives, const FrameHandler& other = {});

// An exchange with each drive, to its end, well or not: by the order of the drives. Frames that aren't SDO answers go
// to `handler`. `boot_ups`: of each drive when it first answered; one that restarts later forgets it all.
[[nodiscard]] std::vector<SdoSequence> exchange(CanNetwork& network, std::span<const DriveSlot> drives,
                                                const FrameHandler& handler, const StepsOf& steps_of,
                                                std::vector<std::uint64_t>* boot_ups = nullptr);

// Throws SetupError where it can't be sent.
void send_nmt(CanNetwork& network, std::span<const DriveSlot> drives, NmtCommand command, const char* name);

// Of the drive that is given the longest time for a change of its NMT state to show.
[[nodiscard]] std::int64_t longest_nmt_timeout_ns(std::span<const DriveSlot> drives) noexcept;

// True as soon as all of them are in this state, by their heartbeats; false after `timeout_ns`.
[[nodiscard]] bool wait_for_state(CanNetwork& network, std::span<const DriveSlot> drives, const FrameHandler& handler,
                                  NmtState state, std::int64_t timeout_ns);

// The refusal of a drive that isn't in the state which is wanted of it; `more` goes behind the state that is found.
[[nodiscard]] description::SetupError not_in_state(const ServoDrive& drive, NmtState wanted, const std::string& more,
                                                   const char* advice);

}  // namespace proxarm::fieldbus
