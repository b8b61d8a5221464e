// Runs `proxarm prove`, and commands that move the arm as `prove` does, with a simulated arm in this process or an arm
// on interfaces.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "controller/extras/proof/proof_session.hpp"
#include "controller/preparation/prepared_session.hpp"

namespace proxarm::command_line {

struct ProofOutcome {
  std::vector<proof::Reading> readings;
  bool complete = false, not_pushed = false;
  controller::FaultReport fault;
  std::optional<double> slipped_rad;
  bool real_arm = false;
};

// Returns why the session ended early, or that the brakes don't hold, as text; empty if nothing failed.
std::string failure_of(const controller::PreparedSession& session, const ProofOutcome& outcome);

// Runs the task with a simulated arm in virtual time, and prints nothing. `arm` is the session of the simulated arm,
// whose cell may differ from the controller's cell. A simulated hand pushes when the proof asks for it. If options.hand
// names a hand, that hand replaces it.
ProofOutcome prove_simulated(const controller::PreparedSession& session, const controller::PreparedSession& arm,
                             const controller::RunOptions& options, const proof::Task& task = {});

// Runs the task on the interfaces of options.bus in real time, and prints on standard error what the person is to do.
// Throws SetupError as `run` does, except that the cell needs no proof.
ProofOutcome prove_on_interfaces(const controller::PreparedSession& session, const controller::RunOptions& options,
                                 const proof::Task& task = {});

// A function that prepares a command's session, and throws SetupError.
using PrepareSession = controller::PreparedSession (*)(const controller::RunOptions& options);

// Prepares the controller's session for a command that moves the arm. Throws SetupError for --hardware with simulated
// buses, for options of a simulated arm with interfaces, for --enabling without a simulated enabling switch, and if a
// bus can't carry the timestep. `arm` is the cell of the simulated arm; empty: the command's own cell.
controller::PreparedSession session_to_prove(const controller::RunOptions& options, const std::filesystem::path& arm,
                                             PrepareSession prepare);

// Prepares the session of the simulated arm. `arm` is the arm's cell; empty: the command's own cell. Throws SetupError.
controller::PreparedSession arm_to_prove(const controller::RunOptions& options, const std::filesystem::path& arm,
                                         PrepareSession prepare);

// Runs the task by prove_simulated() if the buses are simulated, else by prove_on_interfaces().
ProofOutcome prove_arm(const controller::PreparedSession& session, const controller::RunOptions& options,
                       const std::filesystem::path& arm, PrepareSession prepare, const proof::Task& task = {});

}  // namespace proxarm::command_line
