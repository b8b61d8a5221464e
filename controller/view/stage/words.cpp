#include "controller/view/stage/words.hpp"

namespace proxarm::view {

using controller::Fault;
using controller::Phase;
using controller::RecordFlag;

const std::vector<FlagWords>& flag_words() {
  static const std::vector<FlagWords> all{
      {RecordFlag::limit_speed, "the tool is at its speed limit", true},
      {RecordFlag::limit_acceleration, "the tool is at its acceleration limit", true},
      {RecordFlag::limit_workspace, "the border of the workspace holds the tool", true},
      {RecordFlag::limit_joint, "a joint is at the end of its range", true},
      {RecordFlag::limit_leash, "the proxy waits for the tool: the leash is tight", true},
      {RecordFlag::limit_orientation, "the tool's turning is limited", true},
      {RecordFlag::limit_power, "the power that hand and arm exchange is at its limit", true},
      {RecordFlag::limit_keep_out, "a keep-out zone holds the tool", true},
      {RecordFlag::limit_joint_speed, "a joint is at its speed limit", true},
      {RecordFlag::limit_joint_acceleration, "a joint is at its acceleration limit", true},
      {RecordFlag::limit_singularity, "the arm is at the end of its reach, or nearly singular", true},
      {RecordFlag::limit_following_error, "setpoints wait for a drive that doesn't follow", true},
      {RecordFlag::limit_joint_torque, "a drive gives all the torque that it may", true},
      {RecordFlag::guard_speed, "the last guard slows the tool down", true},
      {RecordFlag::guard_elbow, "the last guard slows the elbow down", true},
      {RecordFlag::guard_border, "the last guard keeps the tool within its borders", true},
      {RecordFlag::guard_acceleration, "the last guard softens an acceleration", true},
      {RecordFlag::slowed, "a fault keeps the tool slow", true},
      {RecordFlag::ramp_in, "the hand's force is being let in", false},
      {RecordFlag::hands_off, "nobody holds the handle", false},
      {RecordFlag::oscillation, "the arm oscillates: not stable with this hand", false},
      {RecordFlag::oscillation_lasts, "the arm has been oscillating for half a second", false},
      {RecordFlag::timestep, "the timestep is being changed", false},
      {RecordFlag::sample_held, "a sample of the force sensor is missing", false},
      {RecordFlag::feedback_missing, "a drive's feedback is missing", false},
      {RecordFlag::overrun, "the cycle was late", false}};
  return all;
}

namespace {
const char* sentence_of(Phase phase) noexcept {
  switch (phase) {
    case Phase::idle:
      return "Waiting to begin";
    case Phase::enabling:
      return "Enabling the drives";
    case Phase::taring:
      return "Taring the sensor: hands off";
    case Phase::rendering:
      return "Rendering: the arm follows the hand";
    case Phase::holding:
      return "Holding: the arm stands, its drives enabled";
    case Phase::freeing:
      return "Setting free: slowly, without the scene";
    case Phase::stopping:
      return "Stopping";
    case Phase::disabling:
      return "Switching the drives off";
    case Phase::faulted:
      return "Stopped by a fault: drives off";
    case Phase::done:
      return "Over: drives off";
  }
  return "?";
}
}  // namespace

PhaseWords phase_words(Phase phase) noexcept { return {controller::phase_name(phase), sentence_of(phase)}; }

PhaseWords drive_words(Phase phase) noexcept {
  if (phase == Phase::rendering) return {"drives on", "All drives are enabled: the arm goes where they are sent"};
  if (phase == Phase::enabling) return {"enabling", "Some drives are enabled, others not"};
  return {"drives off", "No drive is enabled: the brakes hold the arm"};
}

std::string fault_text(const controller::CycleRecord& record, const description::Cell& cell) {
  const Fault fault = record.fault != Fault::none ? record.fault : record.held_for;
  if (fault == Fault::none) return "";
  std::string place;
  const bool of_drive = fault == Fault::drive_silent || fault == Fault::drive_fault || fault == Fault::drive_disabled ||
                        fault == Fault::drive_deviates || fault == Fault::drive_blocked ||
                        fault == Fault::feedback_late || fault == Fault::position_implausible;
  if (of_drive && record.fault_where >= 0 && static_cast<std::size_t>(record.fault_where) < cell.drives.size()) {
    place = "drive of " + cell.drives[static_cast<std::size_t>(record.fault_where)].joint;
  }
  controller::FaultReport report{.fault = fault,
                                 .where = record.fault_where,
                                 .cycle = record.fault_cycle,
                                 .value = record.fault_value,
                                 .limit = record.fault_limit};
  if (record.fault == Fault::none) report.reaction = controller::Reaction::hold;
  return controller::describe(report, place);
}

}  // namespace proxarm::view
