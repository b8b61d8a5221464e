// Damps the arm's elastic modes with the measured torques of its gears.
//
// A motor that yields to its gear's torque damps an elastic mode. M: inertia of the link. φ: the link's angle. k: the
// gear's stiffness. θ: the motor's angle. With M φ̈ = τ and θ̇ = −(κ/k) τ, the gear's torque τ follows
//   τ̈ + κ τ̇ + ω² τ = 0,   ω² = k/M
// The motor shouldn't yield to the torques of the setpoints' acceleration, the arm's weight and the hand. So these
// torques are removed from the measured τ: τ̂ = M q̈_f + τ_g of the setpoints that the gear follows now, and −Jᵀh,
// which the hand's force h (by the sensor) adds to τ. A setpoint changes by
//   θ −= (κ/k) y,   y = s/(s + a)² (τ + Jᵀh − τ̂)
// The filter integrates above a/2π = 6.4 Hz and forgets below it. So a sensor's offset moves nothing, and a reading
// error τ_e moves a motor by at most κ τ_e/(k a e). Without Jᵀh a motor also yields to the hand: a felt mass of 10 kg
// at 10 Hz was then wrong by 50 to 80 % instead of 26 %.
//
// Both first-order lags are exact for a constant torque over the period. If a drive's answer is missing, the
// drive's last reading is used. Nothing allocates, locks or throws after construction.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "models/arm/arm.hpp"
#include "models/base/state_archive.hpp"
#include "models/description/cell.hpp"

namespace proxarm::controller {

// a. It is slower than every elastic mode of an arm, and faster than a hand changes its force.
inline constexpr double gear_damping_band_rad_per_s = 40.0;

// Returns the delay from the sending of setpoints to the reading of their torque, in periods, at most 100. It is a sum:
//   - one period until the next SYNC
//   - half a period in which the drive moves, since τ̂ uses the mean acceleration
//   - the lags of drive and reading
[[nodiscard]] double gear_torque_lag_periods(double drive_lag_s, double reading_delay_s, double period_s) noexcept;

// Returns the largest age of a reading of a gear's torque.
[[nodiscard]] double gear_torque_delay_s(const std::vector<description::DriveDescription>& drives) noexcept;

struct GearDampingChoice {
  double damping_per_s = 0.0;  // κ
  std::uint8_t joints = 0;     // bits of the damped joints
};

// Returns the joints that can be damped, as bits. A joint can be damped if its gear's torque is read, and if its motor
// yields within a quarter of the period in which the link oscillates on its gear while the motor and all other joints
// are locked. A motor that yields later drives the mode. Wrist joints oscillate at 80 to 200 Hz and aren't damped: with
// them, an arm would tolerate only half the κ.
[[nodiscard]] std::uint8_t damped_joints(const models::Arm& arm,
                                         const std::vector<description::DriveDescription>& drives, double period_s);

class GearDamping {
 public:
  // Precondition: the torques of the chosen joints are measured.
  GearDamping(const models::Arm& arm, const std::vector<description::DriveDescription>& drives,
              const GearDampingChoice& choice, double period_s);

  void set_period(double period_s) noexcept;
  // Restarts the damping; the first step after it adds nothing to the setpoints.
  void start() noexcept;
  // Returns the addition to the setpoints, rad. asked_Nm: gear torques that the setpoints sent now require, with the
  // mean acceleration over the last period. measured_Nm: the measured torques of the gears plus the hand's torques Jᵀh.
  models::JointVector step(const models::JointVector& asked_Nm, const models::JointVector& measured_Nm) noexcept;
  // Call once per cycle while the arm stands, until start(). weight_Nm: the gear torques that hold the arm's weight.
  void stand(const models::JointVector& weight_Nm, const models::JointVector& measured_Nm) noexcept;
  // A joint whose torque sensor reads the weight with the wrong sign; damping with this reading would drive the modes.
  struct Reversed {
    std::int32_t joint;
    double read_Nm, weight_Nm;
  };
  // Returns the first joint whose reading is reversed. Joints are judged only if their weight torque is at least a
  // quarter of the largest. A sensor's offset looks like a wrong sign only if the offset exceeds 4/3 of the weight
  // torque. Torques read by a second encoder aren't judged, since that encoder's offset is unknown.
  [[nodiscard]] std::optional<Reversed> reversed() const noexcept;
  void archive(fieldbus::StateArchive& state) noexcept;

 private:
  static constexpr std::size_t kept = 128;  // number of kept steps: a power of two, larger than the largest lag
  struct State {
    // slow_Nm: τ + Jᵀh − τ̂ below the band. sum_Nms: y.
    models::JointVector slow_Nm, sum_Nms;
    // Sums of the weight's and the measured torques over the cycles in which the arm has stood.
    models::JointVector weight_Nm, standing_Nm;
    double stood_cycles = 0.0;
    std::uint64_t steps = 0;
    bool started = false;
  };

  models::JointVector yield_rad_per_Nms_;  // κ/k; 0: the joint isn't damped
  std::uint8_t sensors_ = 0;               // bits of the joints damped by a torque sensor
  double drive_lag_s_ = 0.0, reading_delay_s_ = 0.0, period_s_ = 0.0;
  double lag_periods_ = 0.0, decay_ = 1.0;          // decay_ = exp(−aT)
  std::array<models::JointVector, kept> asked_Nm_;  // τ̂ of the last steps
  State state_;
};

}  // namespace proxarm::controller
