// Damps the arm's elastic modes by the torque that is measured in its gears.
//
// A motor that yields to its gear's torque damps the mode: with M φ̈ = τ and θ̇ = −(κ/k) τ the torque follows
// τ̈ + κ τ̇ + ω² τ = 0, where ω² = k/M. What the setpoints' own acceleration asks of the gears isn't to be yielded to,
// nor what the arm carries at rest, nor the hand. So with τ as it is measured, the hand's force h as the sensor reads
// it, and τ̂ = M q̈_f + τ_g of the setpoints that the gear follows now,
//   θ −= (κ/k) y,   y = s/(s + a)² (τ + Jᵀh − τ̂)
// which integrates above a/2π = 6.4 Hz and forgets below: a sensor's offset moves nothing, and a reading that is wrong
// by τ_e moves a motor by κ τ_e/(k a e) at most. (Without Jᵀh a motor yields to the hand as well: 10 kg at 10 Hz were
// felt by 50 to 80 % wrong instead of 26.)
//
// Both first-order lags are exact for a torque that is constant over the period. Where a drive's answer is missing, its
// last reading counts. Neither allocates, locks nor throws after construction.
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

// a: slower than any mode that an arm swings with, faster than hands lean.
inline constexpr double gear_damping_band_rad_per_s = 40.0;

// From where setpoints leave to where the torque that they made is read, in periods: up to the next SYNC, half of the
// period in which the drive gets there, since τ̂ goes by the mean acceleration over it, and behind that by the drive's
// own lag and the reading's. More than a hundred are counted as a hundred.
[[nodiscard]] double gear_torque_lag_periods(double drive_lag_s, double reading_delay_s, double period_s) noexcept;

// How old a reading of the gears' torque is, at most.
[[nodiscard]] double gear_torque_delay_s(const std::vector<description::DriveDescription>& drives) noexcept;

// How gears are damped: κ in 1/s, and a bit for each joint that is.
struct GearDampingChoice {
  double damping_per_s = 0.0;
  std::uint8_t joints = 0;
};

// The joints that can be damped: those whose torque is measured and whose link swings on its gear so slowly, with its
// motor and all other joints locked, that the yielding comes within a quarter of a period. A yielding that comes later
// drives a mode. A wrist's joints swing at 80 to 200 Hz, so they are left as they are; but for these, an arm would bear
// only half the κ.
[[nodiscard]] std::uint8_t damped_joints(const models::Arm& arm,
                                         const std::vector<description::DriveDescription>& drives, double period_s);

class GearDamping {
 public:
  // Precondition: all these joints' torques are measured.
  GearDamping(const models::Arm& arm, const std::vector<description::DriveDescription>& drives,
              const GearDampingChoice& choice, double period_s);

  void set_period(double period_s) noexcept;
  // Begins anew: the first step adds nothing.
  void start() noexcept;
  // `asked_Nm`: what setpoints as they leave now ask of the gears, by their mean acceleration over the period before.
  // `measured_Nm`: the gears' torques and, about the joints, the hand's. Returns what is to be added to the setpoints,
  // rad.
  models::JointVector step(const models::JointVector& asked_Nm, const models::JointVector& measured_Nm) noexcept;
  // While the arm stands, once a cycle until start(): the torques that its weight asks of the gears, and what is
  // measured.
  void stand(const models::JointVector& weight_Nm, const models::JointVector& measured_Nm) noexcept;
  // The first joint whose torque sensor has read the weight with the wrong sign: such a reading drives the modes.
  // Judged where the weight is a quarter of what the joint with most carries, or more. An offset is taken for a wrong
  // sign only where it is beyond 4/3 of that; a second encoder's is unknown, and a joint without a weight tells
  // nothing.
  struct Reversed {
    std::int32_t joint;
    double read_Nm, weight_Nm;
  };
  [[nodiscard]] std::optional<Reversed> reversed() const noexcept;
  void archive(fieldbus::StateArchive& state) noexcept;

 private:
  static constexpr std::size_t kept = 128;  // more than the longest lag, and a power of two
  struct State {
    models::JointVector slow_Nm, sum_Nms;        // τ − τ̂ below the band, and y
    models::JointVector weight_Nm, standing_Nm;  // sums over the cycles in which the arm stood
    double stood_cycles = 0.0;
    std::uint64_t steps = 0;
    bool started = false;
  };

  models::JointVector yield_rad_per_Nms_;  // κ/k; 0 of a joint that isn't damped
  std::uint8_t sensors_ = 0;               // a bit for each joint that is damped by a torque sensor
  double drive_lag_s_ = 0.0, reading_delay_s_ = 0.0, period_s_ = 0.0;
  double lag_periods_ = 0.0, decay_ = 1.0;          // exp(−aT)
  std::array<models::JointVector, kept> asked_Nm_;  // τ̂ of the latest steps
  State state_;
};

}  // namespace proxarm::controller
