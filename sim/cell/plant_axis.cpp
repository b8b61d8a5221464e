#include "sim/cell/plant_axis.hpp"

namespace proxarm::sim {

bool PlantAxis::set_fault(const DeviceFault& fault, bool on, std::int64_t time_ns) noexcept {
  switch (fault.kind) {
    case DeviceFaultKind::runaway:
      runaway_counts_per_s_ = on ? fault.amount * counts_per_rad_ : 0.0;
      break;
    case DeviceFaultKind::reversed:
      target_share_ = on ? -1 : 1;
      break;
    case DeviceFaultKind::ignored:
      target_share_ = on ? 0 : 1;
      break;
    case DeviceFaultKind::weak:
      servo_.set_max_torque_Nm(on ? fault.amount : max_torque_Nm_);
      return true;
    case DeviceFaultKind::offset:
      offset_counts_ = on ? static_cast<std::int32_t>(std::lround(fault.amount * counts_per_rad_)) : 0;
      return true;
    case DeviceFaultKind::stuck:
      stuck_at_counts_ = servo_.position_counts();
      stuck_ = on;
      return true;
    case DeviceFaultKind::torque_stuck:
      return plant_.stick_gear_torque(axis_, on);
    default:
      return false;
  }
  since_ns_ = time_ns;
  since_counts_ = servo_.demand_counts();
  return true;
}

std::int32_t PlantAxis::spoilt(std::int32_t target_counts, std::int64_t time_ns) const noexcept {
  if (target_share_ == 1 && runaway_counts_per_s_ == 0.0) return target_counts;
  const double off = runaway_counts_per_s_ * 1e-9 * static_cast<double>(time_ns - since_ns_);
  return since_counts_ + target_share_ * (target_counts - since_counts_) + static_cast<std::int32_t>(std::lround(off));
}

}  // namespace proxarm::sim
