// `proxarm prove` and what moves as it does: the session, against a simulated arm in this process or on interfaces.
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

// What ended the session before all was read, and brakes that don't hold; empty: nothing.
std::string failure_of(const PreparedSession& session, const ProofOutcome& outcome);

// `arm`: what the simulated arm is, where that isn't what the controller takes it for. A simulated hand pushes where it
// is asked to; with options.hand that one is at the handle all along. In virtual time, nothing printed.
ProofOutcome prove_simulated(const PreparedSession& session, const PreparedSession& arm, const RunOptions& options,
                             const proof::Task& task = {});

// On the interfaces of options.bus, in real time; tells on standard error what is to be done. Throws SetupError as
// `run` does, but wants no proof.
ProofOutcome prove_on_interfaces(const PreparedSession& session, const RunOptions& options,
                                 const proof::Task& task = {});

// Makes a session of a command's options. Throws SetupError.
using PrepareSession = PreparedSession (*)(const RunOptions& options);

// The session of a command that is about to move the arm, once what forbids that has been asked for: a real arm without
// --hardware, what only a simulation has on interfaces, a missing enabling switch, a bus that can't carry it. `arm`:
// the cell of the simulated arm; empty: the command's own. Throws SetupError.
PreparedSession session_to_prove(const RunOptions& options, const std::filesystem::path& arm, PrepareSession prepare);

// The simulated arm's session: of the cell `arm`, or of the command's own where that is empty. Throws SetupError.
PreparedSession arm_to_prove(const RunOptions& options, const std::filesystem::path& arm, PrepareSession prepare);

// prove_simulated() where the bus is simulated, else prove_on_interfaces().
ProofOutcome prove_arm(const PreparedSession& session, const RunOptions& options, const std::filesystem::path& arm,
                       PrepareSession prepare, const proof::Task& task = {});

}  // namespace proxarm::command_line
