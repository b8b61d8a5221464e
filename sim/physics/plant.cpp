#include "sim/physics/plant.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "models/base/setup_error.hpp"

namespace proxarm::sim {
namespace {

using description::Cell;
using description::SetupError;

// Longer than any brake takes to close, and small enough that a sum of periods doesn't overflow.
constexpr std::int64_t far_ns = 10'000'000'000;

std::int64_t servo_period_ns(const Cell& cell, std::size_t drive) {
  const double rate_Hz = cell.drives[drive].simulation.servo_rate_Hz, period_ns = 1e9 / rate_Hz;
  const auto whole = static_cast<std::int64_t>(std::nearbyint(period_ns));
  // The tolerance of 1e-3 ns is far above rounding errors of the division and far below the resolution of a clock.
  if (rate_Hz > 0.0 && whole > 0 && std::abs(period_ns - static_cast<double>(whole)) < 1e-3) return whole;
  throw SetupError({.file = cell.file.string(),
                    .key = "drives[" + std::to_string(drive) + "].simulation.servo_rate_Hz",
                    .found = description::number_text(rate_Hz),
                    .expected = "a rate whose period is a whole number of nanoseconds, such as 4000"});
}

std::int64_t shortest_servo_period_ns(const Cell& cell) {
  if (cell.drives.empty()) throw SetupError({.file = cell.file.string(), .key = "drives", .found = "none"});
  std::int64_t shortest = servo_period_ns(cell, 0);
  for (std::size_t i = 1; i < cell.drives.size(); ++i) shortest = std::min(shortest, servo_period_ns(cell, i));
  for (std::size_t i = 0; i < cell.drives.size(); ++i) {
    if (servo_period_ns(cell, i) % shortest == 0) continue;
    throw SetupError({.file = cell.file.string(),
                      .key = "drives[" + std::to_string(i) + "].simulation.servo_rate_Hz",
                      .found = description::number_text(cell.drives[i].simulation.servo_rate_Hz),
                      .expected = "a whole fraction of the fastest drive's rate"});
  }
  return shortest;
}

}  // namespace

Plant::Plant(const Cell& cell, const description::SensorDescription& sensor, const description::HandDescription& hand,
             std::int64_t start_ns, const PlantConfig& config)
    : step_ns_(shortest_servo_period_ns(cell) / config.finer),
      arm_(cell, hand.mass_kg, 1e-9 * static_cast<double>(step_ns_), hand.inertia_kg_m2),
      hand_(hand, arm_.tool().X_WT),
      force_sensor_(cell.sensor, sensor.simulation, config.noise_seed),
      start_ns_(start_ns),
      time_ns_(start_ns) {
  for (std::size_t i = 0; i < cell.drives.size(); ++i) {
    servo_period_ns_.push_back(servo_period_ns(cell, i));
    const std::int64_t delay_ns = std::llround(1e9 * cell.drives[i].simulation.brake_delay_s);
    brakes_.push_back({.delay_ns = delay_ns, .unpowered_ns = delay_ns});
    servos_.emplace_back(cell.drives[i], servo_period_ns_.back());
    servos_.back().reset(arm_.motor_angle_rad(i), arm_.static_torque_Nm(i));
  }
  torque_Nm_.assign(servos_.size(), 0.0);
  gear_torques_.resize(servos_.size());
  for (std::size_t i = 0; i < servos_.size(); ++i) {
    if (!cell.drives[i].gear_torque) continue;
    gear_torques_[i].emplace(cell.drives[i], step_ns_, config.noise_seed + 1 + i);
    gear_torques_[i]->reset(arm_.gear_torque_Nm(i), arm_.joint_angle_rad(i));
  }
  force_sensor_.reset(time_ns_, arm_.sensor_wrench_S());
  const auto steps = static_cast<std::size_t>(std::llround(1e9 * cell.sensor.delay_s / static_cast<double>(step_ns_)));
  sensed_.assign(steps, arm_.sensor_wrench_S());
}

void Plant::start_hand(std::int64_t time_ns) noexcept {
  hand_started_ = true;
  hand_start_ns_ = time_ns;
}

void Plant::advance_to(std::int64_t time_ns) noexcept {
  while (time_ns_ + step_ns_ <= time_ns) step();
}

void Plant::switch_off(std::size_t axis) noexcept {
  Brake& brake = brakes_[axis];
  if (servos_[axis].powered() && servos_[axis].at_rest() && brake.delay_ns > 0) {
    brake.closes_in_ns = brake.delay_ns;
  } else {
    servos_[axis].disable();
  }
}

// Opens or closes the brake of an axis. Must be called once per servo period.
void Plant::move_brake(std::size_t axis) noexcept {
  Brake& brake = brakes_[axis];
  ServoLoop& servo = servos_[axis];
  if (brake.closes_in_ns > 0) {
    brake.closes_in_ns = servo.powered() ? brake.closes_in_ns - servo_period_ns_[axis] : 0;
    if (servo.powered() && brake.closes_in_ns <= 0) {
      servo.disable();
      brake.unpowered_ns = brake.delay_ns;
    }
  }
  brake.unpowered_ns = servo.powered() ? 0 : std::min(brake.unpowered_ns + servo_period_ns_[axis], far_ns);
  arm_.brake(axis, !servo.powered() && brake.unpowered_ns > brake.delay_ns);
}

void Plant::step() noexcept {
  arm_.advance();
  time_ns_ += step_ns_;
  bool all_powered = true;
  for (std::size_t i = 0; i < servos_.size(); ++i) {
    ServoLoop& servo = servos_[i];
    if ((time_ns_ - start_ns_) % servo_period_ns_[i] == 0) {
      torque_Nm_[i] = servo.update(arm_.motor_angle_rad(i), time_ns_);
      move_brake(i);
    }
    all_powered = all_powered && servo.powered();
  }
  // The person waits until all drives are enabled.
  if (all_powered && !hand_started_) start_hand(time_ns_);
  const double hand_time_s = hand_started_ ? 1e-9 * static_cast<double>(time_ns_ - hand_start_ns_) : 0.0;
  const ToolState& tool = arm_.tool();
  models::Vec3 hand_W = hand_force_ ? hand_force_(hand_time_s, tool.X_WT.translation(), tool.velocity_W)
                                    : hand_.force_W(hand_time_s, tool.X_WT.translation(), tool.velocity_W);
  models::Vec3 arm_W = models::Vec3::Zero();
  if (clamp_) (clamp_->felt ? hand_W : arm_W) += clamp_->force_W(tool.X_WT.translation());
  arm_.apply(torque_Nm_, hand_W, arm_W, hand_.torque_W(hand_time_s, tool.X_WT.linear(), tool.angular_velocity_W));
  for (std::size_t i = 0; i < gear_torques_.size(); ++i) {
    if (gear_torques_[i]) gear_torques_[i]->set(arm_.gear_torque_Nm(i), arm_.joint_angle_rad(i));
  }
  models::Wrench wrench_S = arm_.sensor_wrench_S();
  if (!sensed_.empty()) {
    std::swap(wrench_S, sensed_[next_sensed_]);
    next_sensed_ = (next_sensed_ + 1) % sensed_.size();
  }
  force_sensor_.set_wrench(time_ns_, wrench_S);
}

}  // namespace proxarm::sim
