#include "sim/physics/gear_torque_sensor.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sim/physics/noise.hpp"

namespace proxarm::sim {

GearTorqueSensor::GearTorqueSensor(const description::DriveDescription& drive, std::int64_t step_ns, std::uint64_t seed)
    : sensor_(*drive.gear_torque),
      errors_(drive.simulation),
      stiffness_Nm_per_rad_(drive.gear_stiffness_Nm_per_rad),
      seed_(mixed(seed)),
      late_(static_cast<std::size_t>(std::llround(1e9 * sensor_.delay_s / static_cast<double>(step_ns)))) {}

void GearTorqueSensor::reset(double torque_Nm, double link_rad) noexcept {
  const double value = is_encoder() ? link_rad : torque_Nm;
  std::fill(late_.begin(), late_.end(), value);
  held_Nm_ = torque_Nm;
  read(value);
}

void GearTorqueSensor::set(double torque_Nm, double link_rad) noexcept {
  double value = is_encoder() ? link_rad : torque_Nm;
  if (!late_.empty()) {
    std::swap(value, late_[next_]);
    next_ = (next_ + 1) % late_.size();
  }
  read(value);
}

void GearTorqueSensor::read(double value) noexcept {
  ++number_;
  if (stuck_) return;
  const double noise_Nm =
      errors_.gear_torque_noise_Nm > 0.0 ? errors_.gear_torque_noise_Nm * normal(seed_ + 3 * number_) : 0.0;
  const double added_Nm = errors_.gear_torque_offset_Nm + noise_Nm;
  double counts = 0.0;
  if (is_encoder()) {
    counts = (value - added_Nm / stiffness_Nm_per_rad_) * sensor_.counts_per_revolution / (2.0 * std::numbers::pi);
  } else {
    const double half = 0.5 * errors_.gear_torque_hysteresis_Nm;
    held_Nm_ = std::clamp(held_Nm_, value - half, value + half);
    counts = (errors_.gear_torque_ratio * held_Nm_ + added_Nm) / sensor_.Nm_per_count;
  }
  const double most = sensor_.bits == 16 ? 32767.0 : 2147483647.0;
  counts_ = static_cast<std::int32_t>(std::lround(std::clamp(counts, -most - 1.0, most)));
}

}  // namespace proxarm::sim
