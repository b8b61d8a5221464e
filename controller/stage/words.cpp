#include "controller/stage/words.hpp"

namespace proxarm::view {

using controller::Fault;
using controller::Phase;

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
                        fault == Fault::feedback_late || fault == Fault::position_implausible ||
                        fault == Fault::joint_out_of_range;
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
