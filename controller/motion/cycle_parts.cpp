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

}  // namespace proxarm::controller
