#include "controller/record/cycle_record.hpp"

namespace proxarm::controller {

const char* contact_phase_name(ContactPhase phase) noexcept {
  switch (phase) {
    case ContactPhase::free:
      return "free";
    case ContactPhase::stick:
      return "stick";
    case ContactPhase::slip:
      return "slip";
  }
  return "?";
}

const char* flag_name(RecordFlag flag) noexcept {
  switch (flag) {
    case RecordFlag::sample_held:
      return "sample_held";
    case RecordFlag::sample_late:
      return "sample_late";
    case RecordFlag::feedback_missing:
      return "feedback_missing";
    case RecordFlag::limit_speed:
      return "limit_speed";
    case RecordFlag::limit_acceleration:
      return "limit_acceleration";
    case RecordFlag::limit_workspace:
      return "limit_workspace";
    case RecordFlag::limit_joint:
      return "limit_joint";
    case RecordFlag::limit_leash:
      return "limit_leash";
    case RecordFlag::limit_orientation:
      return "limit_orientation";
    case RecordFlag::hands_off:
      return "hands_off";
    case RecordFlag::truth:
      return "truth";
    case RecordFlag::overrun:
      return "overrun";
    case RecordFlag::limit_power:
      return "limit_power";
    case RecordFlag::limit_keep_out:
      return "limit_keep_out";
    case RecordFlag::limit_joint_speed:
      return "limit_joint_speed";
    case RecordFlag::limit_joint_acceleration:
      return "limit_joint_acceleration";
    case RecordFlag::limit_singularity:
      return "limit_singularity";
    case RecordFlag::limit_following_error:
      return "limit_following_error";
    case RecordFlag::limit_joint_torque:
      return "limit_joint_torque";
    case RecordFlag::oscillation:
      return "oscillation";
    case RecordFlag::power_cut:
      return "power_cut";
    case RecordFlag::unresolved:
      return "unresolved";
    case RecordFlag::timestep:
      return "timestep";
    case RecordFlag::guard_speed:
      return "guard_speed";
    case RecordFlag::guard_elbow:
      return "guard_elbow";
    case RecordFlag::guard_border:
      return "guard_border";
    case RecordFlag::guard_turning:
      return "guard_turning";
    case RecordFlag::ramp_in:
      return "ramp_in";
    case RecordFlag::slowed:
      return "slowed";
    case RecordFlag::oscillation_lasts:
      return "oscillation_lasts";
  }
  return "?";
}

}  // namespace proxarm::controller
