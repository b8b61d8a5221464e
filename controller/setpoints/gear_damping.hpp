// Damps the arm's elastic modes with the measured torques of its gears.
//
// A motor that yields to its gear's torque damps the mode: with M φ̈ = τ and θ̇ = −(κ/k) τ the torque follows τ̈ + κ τ̇
// + ω² τ = 0, where ω² = k/M. The motor shouldn't yield to the torque of the setpoints' own acceleration, the arm's
// weight or the hand. So with the measured τ, the hand's force h by the sensor, and τ̂ = M q̈_f + τ_g of the setpoints
// that the gear follows now,
//   θ −= (κ/k) y,   y = s/(s + a)² (τ + Jᵀh − τ̂)
// This integrates above a/2π = 6.4 Hz and forgets below: a sensor's offset moves nothing, and a reading error τ_e moves
// a motor by at most κ τ_e/(k a e). (Without Jᵀh a motor also yields to the hand: 10 kg at 10 Hz felt 50 to 80 % wrong
// instead of 26.)
//
// Both first-order lags are exact for a constant torque over the period. A missing answer of a drive is replaced by its
// last reading. No allocation, lock or throw after construction.
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

// a: slower than any mode of an arm, faster than a hand changes its force.
inline constexpr double gear_damping_band_rad_per_s = 40.0;

// Delay from setpoints leaving to the reading of their torque, in periods: up to the next SYNC; half of the period in
// which the drive moves, since τ̂ uses the mean acceleration; the lags of drive and reading. At most 100.
[[nodiscard]] double gear_torque_lag_periods(double drive_lag_s, double reading_delay_s, double period_s) noexcept;

// Largest age of a gear torque reading.
[[nodiscard]] double gear_torque_delay_s(const std::vector<description::DriveDescription>& drives) noexcept;

// κ in 1/s, and bits of the damped joints.
struct GearDampingChoice {
  double damping_per_s = 0.0;
  std::uint8_t joints = 0;
};

// The joints that can be damped: those with a torque reading whose link, with its motor and all other joints locked,
// swings so slowly on its gear that yielding comes within a quarter of a period; later yielding drives a mode. Wrist
// joints swing at 80 to 200 Hz and aren't damped: with them, an arm would tolerate only half the κ.
[[nodiscard]] std::uint8_t damped_joints(const models::Arm& arm,
                                         const std::vector<description::DriveDescription>& drives, double period_s);

class GearDamping {
 public:
  // Precondition: the torques of the chosen joints are measured.
  GearDamping(const models::Arm& arm, const std::vector<description::DriveDescription>& drives,
              const GearDampingChoice& choice, double period_s);

  void set_period(double period_s) noexcept;
  // Restarts; the first step adds nothing.
  void start() noexcept;
  // asked_Nm: gear torques required by the setpoints that leave now, with the mean acceleration over the period before.
  // measured_Nm: the gears' torques plus the hand's, about the joints. Returns an addition to the setpoints, rad.
  models::JointVector step(const models::JointVector& asked_Nm, const models::JointVector& measured_Nm) noexcept;
  // Call once per cycle while the arm stands, until start(). weight_Nm: gear torques by the arm's weight.
  void stand(const models::JointVector& weight_Nm, const models::JointVector& measured_Nm) noexcept;
  // The first joint whose torque sensor reads the weight with the wrong sign; such a reading drives the modes. Only
  // joints are judged whose weight is at least a quarter of the largest. An offset looks like a wrong sign only beyond
  // 4/3 of the weight. A second encoder's offset is unknown, so such readings aren't judged.
  struct Reversed {
    std::int32_t joint;
    double read_Nm, weight_Nm;
  };
  [[nodiscard]] std::optional<Reversed> reversed() const noexcept;
  void archive(fieldbus::StateArchive& state) noexcept;

 private:
  static constexpr std::size_t kept = 128;  // longer than the largest lag; a power of two
  struct State {
    models::JointVector slow_Nm, sum_Nms;        // τ − τ̂ below the band; y
    models::JointVector weight_Nm, standing_Nm;  // sums over the cycles of standing
    double stood_cycles = 0.0;
    std::uint64_t steps = 0;
    bool started = false;
  };

  models::JointVector yield_rad_per_Nms_;  // κ/k; 0: not damped
  std::uint8_t sensors_ = 0;               // bits of the joints damped by a torque sensor
  double drive_lag_s_ = 0.0, reading_delay_s_ = 0.0, period_s_ = 0.0;
  double lag_periods_ = 0.0, decay_ = 1.0;          // exp(−aT)
  std::array<models::JointVector, kept> asked_Nm_;  // τ̂ of the last steps
  State state_;
};

}  // namespace proxarm::controller
