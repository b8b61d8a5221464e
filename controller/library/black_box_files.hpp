// The black box of a session, and what else of it can be computed again: how large it is, and its folder. The command
// line has a process of its own write that folder (command_line/sessions/black_box_keeper.hpp).
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "controller/preparation/prepared_session.hpp"
#include "controller/record/black_box.hpp"
#include "controller/record/replay_log.hpp"
#include "controller/session/bring_up.hpp"

namespace proxarm::controller {

// The arguments of BlackBox.
struct BoxSize {
  double period_s;
  std::size_t frames_per_cycle;
};
// If the timestep may change, the box has room for cycles down to 1 ms.
BoxSize box_size(const PreparedSession& session, bool timestep_may_change);

// The folder of --black-box, else one in the folder of --record; empty: neither is given.
std::filesystem::path black_box_folder(const RunOptions& options);

// Returns the head of the session's replay; its first cycle and state aren't filled in. Throws SetupError.
ReplayHead replay_head(const PreparedSession& session, const std::vector<std::string>& bus_names,
                       const BusIndices& indices);
// Returns all files from which the session was prepared.
std::vector<std::filesystem::path> replay_files(const PreparedSession& session);

enum class Replay : std::uint8_t { none, kept };

// Writes the last seconds of the session to `folder`. Throws SetupError.
void write_black_box(const std::filesystem::path& folder, const BlackBox& box, const ReplayHead& head,
                     const PreparedSession& session, const std::string& reason, Replay replay = Replay::kept);

}  // namespace proxarm::controller
