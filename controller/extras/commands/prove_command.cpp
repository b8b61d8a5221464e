#include <cstdio>
#include <limits>
#include <numbers>

#include "controller/extras/commands/commands.hpp"
#include "controller/extras/commissioning/bus_loss_run.hpp"
#include "controller/extras/commissioning/proof_run.hpp"
#include "controller/preparation/bus_plan.hpp"
#include "controller/preparation/data_files.hpp"
#include "controller/preparation/prepared_session.hpp"
#include "controller/preparation/proof_file.hpp"
#include "controller/preparation/start_check.hpp"
#include "models/base/setup_error.hpp"
#include "models/files/json.hpp"

namespace proxarm::command_line {
namespace {

using description::Json;

constexpr int not_proven = 1;

controller::PreparedSession prepared_proof(const controller::RunOptions& options) {
  controller::RunOptions run = options;
  run.scene = controller::shipped_file("scenes/free.yaml");
  controller::PreparedSession session = controller::prepare(run);
  // The proof tests the sensor's mounting and zero, so the tare isn't compared with a known zero.
  session.settings.zero_drift_N = std::numeric_limits<double>::infinity();
  if (!session.impedance()) return session;
  throw description::SetupError({.file = session.cell.file.string(),
                                 .key = "prove",
                                 .found = "a cell of the impedance type",
                                 .expected = "one whose drives take positions"});
}

// Explains how to get a simulated hand that pushes as the proof asks, because a hand in another process doesn't know
// what the proof asks for.
void tell_of_helper() {
  std::fprintf(
      stderr,
      "proxarm prove: a simulated arm's hand plays its own motion; somebody who pushes as a proof asks is there "
      "where the arm was started by `proxarm sim --for-proof`\n");
}

std::string text_of(const proof::Verdict& verdict, const std::string& failure) {
  if (!failure.empty()) return failure + "\nNOT PROVEN\n";
  return proof::text(verdict);
}

Json json_of(const proof::Explanation& e) {
  return {{"mistake", e.mistake}, {"residual", e.residual}, {"angle_deg", e.angle_rad * 180.0 / std::numbers::pi}};
}

Json json_of(const proof::Verdict& verdict, const std::string& failure) {
  Json mistakes = Json::array();
  for (const proof::Explanation& mistake : verdict.mistakes) mistakes.push_back(json_of(mistake));
  return {{"proven", failure.empty() && verdict.proven},
          {"failure", failure},
          {"as_it_is", json_of(verdict.as_it_is)},
          {"mistakes", mistakes}};
}

}  // namespace

int prove_command(const ProveOptions& options) {
  const bool simulated = options.run.bus.simulated();
  controller::require_interface_for_hardware(options.run);
  if (!simulated) controller::refuse_simulated_options(options.run, options.arm);
  const controller::PreparedSession session = prepared_proof(options.run);
  if (!options.bus_loss) proof::require_provable(session.cell, models::Arm(session.cell));
  controller::require_enabling_switch(session, options.run);
  controller::require_carried(session, options.run);
  const std::filesystem::path file = options.out.empty() ? controller::proof_path(session.cell) : options.out;
  if (options.bus_loss) {
    return prove_bus_loss(session, arm_to_prove(options.run, options.arm, prepared_proof), options.run, file);
  }
  const ProofOutcome outcome = prove_arm(session, options.run, options.arm, prepared_proof);
  const std::string failure = failure_of(session, outcome);
  proof::Verdict verdict;
  if (failure.empty()) verdict = proof::judge(session.cell, models::Arm(session.cell), outcome.readings);
  const bool proven = failure.empty() && verdict.proven;
  const std::string told = options.run.json ? json_of(verdict, failure).dump() + "\n" : text_of(verdict, failure);
  std::fputs(told.c_str(), stdout);
  if (!failure.empty() && !simulated && !outcome.real_arm) tell_of_helper();
  if (!proven) return not_proven;
  controller::ProofFile proof{controller::cell_sha256(session),
                              outcome.real_arm,
                              controller::today(),
                              "signs, ratios, sensor and brakes proven",
                              true,
                              {}};
  if (const auto kept = controller::kept_proof(file, proof.cell_sha256, proof.real_arm))
    proof.bus_loss = kept->bus_loss;
  controller::write_proof(file, proof);
  if (!options.run.json) {
    std::printf("proof, on a %s arm: %s\n", outcome.real_arm ? "real" : "simulated", file.c_str());
  }
  return 0;
}

}  // namespace proxarm::command_line
