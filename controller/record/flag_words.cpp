#include "controller/record/flag_words.hpp"

namespace proxarm::controller {

const std::vector<FlagWords>& flag_words() {
  static const std::vector<FlagWords> all{
      {RecordFlag::limit_speed, "the tool is at its speed limit", true},
      {RecordFlag::limit_acceleration, "the tool is at its acceleration limit", true},
      {RecordFlag::limit_workspace, "the border of the workspace holds the tool", true},
      {RecordFlag::limit_joint, "a joint is at the end of its range", true},
      {RecordFlag::limit_leash, "the proxy waits for the tool: the leash is tight", true},
      {RecordFlag::limit_orientation,
       "the tool's turning is at a limit: max_turning_speed_rad_per_s, max_turn_rad, max_tilt_rad or max_twist_rad",
       true},
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
      {RecordFlag::guard_turning, "the last guard keeps the tool within its limits of turning", true},
      {RecordFlag::unresolved, "a step that keeps not all laws of contact", false},
      {RecordFlag::power_cut, "the drives' power is cut: stop category 0", false},
      {RecordFlag::slowed, "a fault keeps the tool slow", true},
      {RecordFlag::ramp_in, "the hand's force is being let in", false},
      {RecordFlag::hands_off, "nobody holds the handle", false},
      {RecordFlag::oscillation, "the arm oscillates: not stable with this hand", false},
      {RecordFlag::oscillation_lasts, "the arm has been oscillating for half a second", false},
      {RecordFlag::timestep, "the timestep is being changed", false},
      {RecordFlag::sample_held, "a sample of the force sensor is missing", false},
      {RecordFlag::sample_late, "a sample of the force sensor came a cycle late", false},
      {RecordFlag::feedback_missing, "a drive's feedback is missing", false},
      {RecordFlag::overrun, "the cycle was late", false}};
  return all;
}

const char* words_of(RecordFlag flag) noexcept {
  for (const FlagWords& each : flag_words()) {
    if (each.flag == flag) return each.words;
  }
  return "?";
}

}  // namespace proxarm::controller
