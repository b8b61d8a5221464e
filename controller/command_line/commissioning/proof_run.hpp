// Runs `proxarm prove`, and commands that move the arm in the same way, against a simulated arm in this process or on
// interfaces.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "controller/command_line/preparation/prepared_session.hpp"
#include "controller/proof/proof_session.hpp"

namespace proxarm::command_line {

struct ProofOutcome {
  std::vector<proof::Reading> readings;
  bool complete = false, not_pushed = false;
  controller::FaultReport fault;
  std::optional<double> slipped_rad;
  bool real_arm = false;
};

// Says why the session ended early, or that the brakes don't hold; empty: no failure.
std::string failure_of(const PreparedSession& session, const ProofOutcome& outcome);

// Runs in virtual time and prints nothing. `arm` is the simulated arm, which may differ from the controller's cell. A
// simulated hand pushes when asked; a hand in options.hand replaces it.
ProofOutcome prove_simulated(const PreparedSession& session, const PreparedSession& arm, const RunOptions& options,
                             const proof::Task& task = {});

// Runs on the interfaces of options.bus in real time, and prints on standard error what the person is to do. Throws
// SetupError as `run` does, but needs no proof.
ProofOutcome prove_on_interfaces(const PreparedSession& session, const RunOptions& options,
                                 const proof::Task& task = {});

// Throws SetupError.
using PrepareSession = PreparedSession (*)(const RunOptions& options);

// Prepares a session that moves the arm. Refuses a real arm without --hardware, options of a simulation on interfaces,
// a missing enabling switch, and a bus that can't carry the timestep. `arm`: the cell of the simulated arm; empty: the
// command's own. Throws SetupError.
PreparedSession session_to_prove(const RunOptions& options, const std::filesystem::path& arm, PrepareSession prepare);

// Prepares the simulated arm's session: from the cell `arm`, or from the command's own if empty. Throws SetupError.
PreparedSession arm_to_prove(const RunOptions& options, const std::filesystem::path& arm, PrepareSession prepare);

// Calls prove_simulated() if the bus is simulated, else prove_on_interfaces().
ProofOutcome prove_arm(const PreparedSession& session, const RunOptions& options, const std::filesystem::path& arm,
                       PrepareSession prepare, const proof::Task& task = {});

}  // namespace proxarm::command_line
