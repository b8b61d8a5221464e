#include <cstdio>
#include <limits>

#include "controller/command_line/entry/exit_status.hpp"
#include "controller/extras/commands/commands.hpp"
#include "controller/extras/commissioning/identified_tool.hpp"
#include "controller/extras/commissioning/proof_run.hpp"
#include "controller/extras/identification/tool_stations.hpp"
#include "controller/preparation/data_files.hpp"
#include "models/base/setup_error.hpp"

namespace proxarm::command_line {
namespace {

constexpr int not_identified = 1;
// Times to wait after each move, and to read the sensor. The arm swings at 10 Hz and above after a move; the mean of
// the readings over half a second is accurate to a few millinewtons.
constexpr double settle_s = 0.7, read_s = 0.5;

controller::PreparedSession prepared_to_identify(const controller::RunOptions& options) {
  controller::RunOptions run = options;
  run.scene = controller::shipped_file("scenes/free.yaml");
  controller::PreparedSession session = controller::prepare(run);
  if (!session.impedance()) return session;
  throw description::SetupError({.file = session.cell.file.string(),
                                 .key = "identify",
                                 .found = "a cell of the impedance type",
                                 .expected = "one whose drives take positions: torques don't hold poses to a "
                                             "milliradian"});
}

ProofOutcome read(const controller::PreparedSession& session, const IdentifyOptions& options, const models::Arm& arm) {
  const proof::Task task{.stations =
                             [&](const models::JointVector& motor_rad) {
                               return identification::tool_stations(session.cell, arm, motor_rad);
                             },
                         .settle_s = settle_s,
                         .read_s = read_s};
  return prove_arm(session, options.run, options.arm, prepared_to_identify, task);
}

IdentifiedTool identified(controller::PreparedSession session, const IdentifyOptions& options) {
  IdentifiedTool tool;
  tool.allowances = identification::allowances_of(session.settings.zero_drift_N);
  // The load behind the sensor is unknown, so the tare may differ from the known zero by any force.
  session.settings.zero_drift_N = std::numeric_limits<double>::infinity();
  const models::Arm arm(session.cell);
  const auto stations = identification::tool_stations(session.cell, arm, arm.motor_from_link(arm.start_rad()));
  tool.not_shown = identification::not_shown(session.cell, arm, stations, tool.allowances);
  if (stations.size() == 1) return tool;
  const ProofOutcome outcome = read(session, options, arm);
  tool.failure = failure_of(session, outcome);
  tool.real_arm = outcome.real_arm;
  tool.readings = outcome.readings;
  if (!tool.failure.empty()) return tool;
  tool.fit = identification::identify_tool(session.cell, tool.readings, tool.allowances);
  tool.failure = identification::doubts(tool.fit, tool.allowances);
  if (tool.fit.mass_found && !tool.fit.centre_found && tool.not_shown.empty()) {
    tool.not_shown = "centre of mass and zero of the torque: the mass is no more than its uncertainty";
  }
  return tool;
}

void write(const IdentifiedTool& tool, const controller::PreparedSession& session, bool told) {
  const std::filesystem::path backup = write_tool(tool, session);
  if (!told) return;
  std::printf(
      "written to %s and %s; before: %s\n"
      "a proof of the cell as it was holds no more; tool.inertia_kg_m2 is as it was: poses at rest don't show it\n",
      session.cell.file.c_str(), controller::zero_path(session.cell).c_str(), backup.c_str());
}

}  // namespace

int identify_command(const IdentifyOptions& options) {
  const controller::PreparedSession session = session_to_prove(options.run, options.arm, prepared_to_identify);
  const IdentifiedTool tool = identified(session, options);
  std::vector<ToolDifference> differences;
  bool same = true;
  if (options.compare) {
    differences = compare(tool, session.cell, controller::kept_zero(session, tool.real_arm));
    for (const ToolDifference& difference : differences) same = same && !difference.differs();
  }
  if (options.run.json) {
    description::Json told = json(tool);
    if (options.compare) told["compared"] = json(differences);
    std::printf("%s\n", told.dump().c_str());
  } else {
    std::fputs((text(tool) + text(differences)).c_str(), stdout);
  }
  if (!tool.whole()) return not_identified;
  if (options.write) write(tool, session, !options.run.json);
  return same || options.write ? fine : not_identified;
}

}  // namespace proxarm::command_line
