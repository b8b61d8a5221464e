// Runs `proxarm run --bus sim`: controller and simulated arm in one process, on in-process buses.
#pragma once

#include <memory>

#include "controller/command_line/sessions/session_output.hpp"
#include "controller/library/recorded_messages.hpp"
#include "controller/library/simulated_loop.hpp"
#include "controller/preparation/prepared_session.hpp"

namespace proxarm::command_line {

class SimulatedRun {
 public:
  // Throws SetupError. `arm` is the simulated arm, which may differ from the session's cell. Preconditions: `session`,
  // `options` and `keeper` outlive the run.
  SimulatedRun(const controller::PreparedSession& session, const controller::PreparedSession& arm,
               const controller::RunOptions& options, BlackBoxKeeper& keeper);

  // Runs the session and returns the exit status. Throws SetupError only before the arm moves.
  int run();

 private:
  void keep_record();
  int run_cycles();
  void drain(controller::CycleRecord record, const sim::Truth& truth);

  const controller::PreparedSession& session_;
  const controller::RunOptions& options_;
  BlackBoxKeeper& keeper_;
  controller::SimulatedLoop loop_;
  SessionOutput output_;
  std::unique_ptr<controller::ReplayRecorder> replay_;
  std::unique_ptr<controller::RecordedMessages> messages_;
};

}  // namespace proxarm::command_line
