#include <cstdio>
#include <memory>

#include "controller/command_line/entry/exit_status.hpp"
#include "controller/extras/commands/commands.hpp"
#include "controller/extras/commissioning/identified_joints.hpp"
#include "controller/extras/commissioning/proof_run.hpp"
#include "controller/extras/identification/joints/joint_motion.hpp"
#include "controller/preparation/data_files.hpp"
#include "fieldbus/cia402/cia402_mode.hpp"
#include "models/base/setup_error.hpp"

namespace proxarm::command_line {
namespace {

using description::SetupError;

constexpr int no_figure = 1;

[[noreturn]] void refuse(const controller::PreparedSession& session, const std::string& found,
                         const std::string& expected) {
  throw SetupError(
      {.file = session.cell.file.string(), .key = "identify --joints", .found = found, .expected = expected});
}

// Asks each drive for its torque if the drive's PDO has room for it behind the position. A drive that can't send the
// torque reports that at bring-up, and is then used without its torque.
void ask_for_torques(description::Cell& cell) {
  constexpr int classic_bytes = 8;
  for (description::DriveDescription& drive : cell.drives) {
    if (fieldbus::extra_torque_byte(drive)) continue;
    const bool fits = drive.fd || fieldbus::pdo_bytes(fieldbus::tpdo_mapping(drive)) + 2 <= classic_bytes;
    if (fits && drive.rated_torque_Nm > 0.0) drive.feedback.push_back({drive.objects.torque, 16});
  }
}

controller::PreparedSession prepared_joints(const controller::RunOptions& options) {
  controller::RunOptions run = options;
  run.scene = controller::shipped_file("scenes/free.yaml");
  controller::PreparedSession session = controller::prepare(run);
  if (session.impedance()) {
    refuse(session, "a cell of the impedance type",
           "one whose drives take positions: torques don't lead motors along a motion to a microradian");
  }
  for (const description::DriveDescription& drive : session.cell.drives) {
    if (!drive.on_can()) refuse(session, drive.joint + ": a drive on Modbus", "drives on CAN, which answer each cycle");
  }
  ask_for_torques(session.cell);
  return session;
}

IdentifiedJoints identified(const controller::PreparedSession& session, const IdentifyOptions& options,
                            const models::Arm& arm) {
  const auto exercise = std::make_shared<identification::JointExercise>(session.cell, arm, session.settings.period_s);
  proof::Task task{.stations = [&](const models::JointVector& motor_rad) { return exercise->stations(motor_rad); }};
  task.exercise = exercise;
  const ProofOutcome outcome = prove_arm(session, options.run, options.arm, prepared_joints, task);
  IdentifiedJoints joints;
  joints.failure = failure_of(session, outcome);
  joints.real_arm = outcome.real_arm;
  if (!joints.failure.empty()) return joints;
  const identification::Allowed allowed{.zero_drift_N = session.settings.zero_drift_N};
  joints.fit = identification::identify_joints(session.cell, exercise->records(), allowed);
  joints.failure = joints.fit.doubt;
  return joints;
}

}  // namespace

int identify_joints_command(const IdentifyOptions& options) {
  const controller::PreparedSession session = session_to_prove(options.run, options.arm, prepared_joints);
  const models::Arm arm(session.cell);
  const auto motions =
      identification::joint_motions(session.cell, arm, arm.motor_from_link(arm.start_rad()), session.settings.period_s);
  if (!options.run.json) {
    std::fputs(identification::text(motions, arm, session.settings.period_s).c_str(), stdout);
    std::fflush(stdout);
  }
  const IdentifiedJoints joints = identified(session, options, arm);
  const std::vector<JointFigure> all =
      joints.failure.empty() ? figures(joints, session.cell) : std::vector<JointFigure>{};
  if (options.run.json) {
    std::printf("%s\n", json(joints, all, options.compare).dump().c_str());
  } else {
    std::fputs(text(joints, all, options.compare).c_str(), stdout);
  }
  if (!joints.found()) return no_figure;
  if (options.write) {
    const std::filesystem::path backup = write_joints(all, session);
    if (!options.run.json) {
      std::printf("written to %s; before: %s\na proof of the cell as it was holds no more\n", session.cell.file.c_str(),
                  backup.c_str());
    }
    return fine;
  }
  bool differs = false;
  for (const JointFigure& figure : all) differs = differs || figure.differs();
  return options.compare && differs ? no_figure : fine;
}

}  // namespace proxarm::command_line
