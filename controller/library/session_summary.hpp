// What a session says of itself, out of its records and of what its cycle found: the same for the command line and for
// programs of one's own.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "controller/cycle/cycle.hpp"
#include "controller/preparation/prepared_session.hpp"
#include "controller/record/cycle_record.hpp"
#include "controller/report/summary.hpp"
#include "controller/session/session.hpp"

namespace proxarm::controller {

std::vector<std::string> joint_names(const description::Cell& cell);
SummaryConfig summary_config(const PreparedSession& session);
// Fills in what only the scene knows, distances and friction, after so much rendering.
void complete(CycleRecord& record, const PreparedSession& session, std::int64_t rendered_ns);

// Returns the session's length. If no person can end a release, the length also has the longest time of a release.
SessionLength session_length(const PreparedSession& session, const RunOptions& options);

// What is rendered, in a few words: "4 kg felt"; and with scene and timestep, above a plot.
std::string rendered_text(const PreparedSession& session);
std::string plot_title(const PreparedSession& session);

// Of all that was added to `builder` and what the cycle found; the caller fills in what only it knows. `asked`: who
// asked for the end, of SessionEnd::asked.
Summary session_summary(SummaryBuilder& builder, const Cycle& cycle, SessionEnd end, const EndSummary& asked,
                        const PreparedSession& session);

// What the session's script said and didn't come to pass.
void add_idle_orders(Summary& summary, const Cycle& cycle, const RunOptions& options);

}  // namespace proxarm::controller
