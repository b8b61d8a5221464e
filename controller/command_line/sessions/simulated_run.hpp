// Runs `proxarm run --bus sim`: controller and simulated arm in one process, on in-process buses.
#pragma once

#include <optional>

#include "controller/command_line/preparation/prepared_session.hpp"
#include "controller/command_line/sessions/recorded_messages.hpp"
#include "controller/command_line/sessions/session_output.hpp"
#include "controller/session/bring_up.hpp"
#include "fieldbus/simulated/simulated_can_network.hpp"
#include "sim/cell/simulated_cell.hpp"

namespace proxarm::command_line {

class SimulatedRun {
 public:
  // Throws SetupError. `arm` is the simulated arm, which may differ from the session's cell. Preconditions: `session`,
  // `options` and `keeper` outlive the run.
  SimulatedRun(const PreparedSession& session, const PreparedSession& arm, const RunOptions& options,
               BlackBoxKeeper& keeper);

  // Runs the session and returns the exit status. Throws SetupError only before the arm moves.
  int run();

 private:
  int run_cycles(controller::CycleParts parts);
  void drain(controller::SpscRing<controller::CycleRecord>& records);

  const PreparedSession& session_;
  const RunOptions& options_;
  BlackBoxKeeper& keeper_;
  fieldbus::SimulatedCanNetwork network_;
  sim::SimulatedCell far_end_;
  scenes::CompiledScene scene_;
  SessionOutput output_;
  std::unique_ptr<controller::ReplayRecorder> replay_;
  std::unique_ptr<RecordedMessages> messages_;
  std::optional<std::int64_t> exploded_at_ns_;  // when the simulated arm's motion became impossible
  std::int64_t power_on_ns_ = 0;
  sim::Truth truth_;  // the simulation's truth at the present cycle's SYNC
};

}  // namespace proxarm::command_line
