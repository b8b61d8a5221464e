// One axis of the simulated arm as its drive sees it: in encoder counts, with simulated faults of motor and encoder.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>

#include "models/description/cell.hpp"
#include "sim/devices/device_fault.hpp"
#include "sim/devices/servo_axis.hpp"
#include "sim/physics/plant.hpp"

namespace proxarm::sim {

class PlantAxis final : public ServoAxis {
 public:
  PlantAxis(Plant& plant, std::size_t axis, const description::DriveDescription& drive)
      : plant_(plant),
        axis_(axis),
        servo_(plant.servo(axis)),
        counts_per_rad_(drive.counts_per_rad()),
        rated_torque_Nm_(drive.rated_torque_Nm > 0.0 ? drive.rated_torque_Nm : drive.simulation.max_torque_Nm),
        max_torque_Nm_(drive.simulation.max_torque_Nm) {}

  void enable(std::int64_t time_ns) noexcept override { plant_.enable(axis_, time_ns); }
  void disable() noexcept override { plant_.switch_off(axis_); }
  void set_interpolation_period_ns(std::int64_t period_ns) noexcept override {
    servo_.set_interpolation_period_ns(period_ns);
  }
  void set_target(std::int32_t target_counts, std::int64_t time_ns) noexcept override {
    servo_.set_target(spoilt(target_counts, time_ns), time_ns);
  }
  void set_torque(double ratio) noexcept override {
    if (target_share_ != 0) torque_ratio_ = target_share_ * ratio;
    servo_.set_torque_Nm(std::copysign(1.0, counts_per_rad_) * torque_ratio_ * rated_torque_Nm_);
  }
  void stop(double deceleration_counts_per_s2, std::int64_t time_ns) noexcept override {
    servo_.stop(deceleration_counts_per_s2 / std::abs(counts_per_rad_), time_ns);
  }
  [[nodiscard]] std::int32_t position_counts() const noexcept override {
    return stuck_ ? stuck_at_counts_ : servo_.position_counts() + offset_counts_;
  }
  [[nodiscard]] std::int32_t demand_counts() const noexcept override { return servo_.demand_counts(); }
  [[nodiscard]] double speed_counts_per_s() const noexcept override {
    return servo_.speed_rad_per_s() * counts_per_rad_;
  }
  [[nodiscard]] double torque_ratio() const noexcept override {
    return std::copysign(1.0, counts_per_rad_) * servo_.torque_Nm() / rated_torque_Nm_;
  }
  [[nodiscard]] std::int32_t gear_torque_counts() const noexcept override { return plant_.gear_torque_counts(axis_); }
  [[nodiscard]] bool limited() const noexcept override { return servo_.limited(); }
  [[nodiscard]] bool at_rest() const noexcept override { return servo_.at_rest(); }

  // Sets a fault of the motor's torque, of the encoder, or of how the drive uses its targets. False for any other
  // fault.
  bool set_fault(const DeviceFault& fault, bool on, std::int64_t time_ns) noexcept;

 private:
  [[nodiscard]] std::int32_t spoilt(std::int32_t target_counts, std::int64_t time_ns) const noexcept;

  Plant& plant_;
  std::size_t axis_;
  ServoLoop& servo_;
  double counts_per_rad_, rated_torque_Nm_, max_torque_Nm_;
  double runaway_counts_per_s_ = 0.0;
  // Factor on the difference between a target and since_counts_. A torque is multiplied by it; if it is 0, the last
  // torque is kept.
  std::int32_t target_share_ = 1;
  double torque_ratio_ = 0.0;  // torque requested from the motor, as a share of the rated torque
  std::int32_t since_counts_ = 0, offset_counts_ = 0, stuck_at_counts_ = 0;
  std::int64_t since_ns_ = 0;
  bool stuck_ = false;
};

}  // namespace proxarm::sim
