#include "controller/motion/cycle_parts.hpp"

namespace proxarm::controller {

std::array<double, models::max_axes> max_steps_rad(const std::vector<description::DriveDescription>& drives,
                                                   double period_s) noexcept {
  std::array<double, models::max_axes> steps = models::InverseKinematicsConfig{}.max_step_rad;
  for (std::size_t i = 0; i < drives.size() && i < steps.size(); ++i) {
    steps[i] = drives[i].max_speed_rad_per_s * period_s;
  }
  return steps;
}

OverdueDrive first_overdue(const std::vector<DriveOnBus>& drives, std::uint8_t following, double waited_s,
                           double usual_s) noexcept {
  for (std::size_t i = 0; i < drives.size(); ++i) {
    const double limit_s = drives[i].drive.description().bring_up.enable_timeout_s.value_or(usual_s);
    if ((following >> i & 1U) == 0 && waited_s > limit_s) return {static_cast<int>(i), limit_s};
  }
  return {};
}

}  // namespace proxarm::controller
