// Moves the joints for identification, one after the other, and records encoders, drives and sensor.
//
// Each joint makes two motions about the arm's initial pose, with the base frequency f = 1/period:
//   slow   q = A sin(2π f t)                          shows friction, by the torque's square part and sine part
//   fast   q = Σ_h a/(2π h f)² cos(2π h f t + ψ_h)    shows rotor and gear; lines from 3 to 40 Hz, h = 6, 9, 12 …
// ψ_h are Schroeder's phases ("Synthesis of low-peak-factor signals", 1970), which keep the motion's peak low.
// Minimum-jerk ramps fade both motions in and out. Recording starts one period after the ramp, when the arm swings
// steadily, and covers whole periods. So the lines have no leakage, and differences between periods are noise.
//
// A and a are as large as these bounds allow:
//   angle          0.1 rad; half of the way to the end of the joint's range
//   speed          a fifth of the joint's speed; 0.06 m/s of the tool in the slow motion
//   acceleration   per line, 3 % of the drive's acceleration and 0.25 m/s² of the tool, in the fast motion
//   torque         a fifth of the drive's torque
//   place          workspace_m and keep_out_m
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "controller/extras/proof/exercise.hpp"
#include "controller/extras/proof/proof.hpp"
#include "models/arm/arm.hpp"
#include "models/description/cell.hpp"

namespace proxarm::identification {

inline constexpr int slow_periods = 3, fast_periods = 4;
inline constexpr double lowest_line_Hz = 3.0, highest_line_Hz = 40.0;
inline constexpr double base_period_s = 2.0, ramp_s = 1.0;  // the period is rounded to whole cycles

struct JointMotion {
  int joint = 0;
  bool fast = false;
  double amplitude = 0.0;  // slow: A in rad; fast: a in rad/s²

  [[nodiscard]] int periods() const noexcept { return fast ? fast_periods : slow_periods; }
};

// The readings of a motion: whole periods, with a row per cycle.
struct MotionRecord {
  JointMotion motion;
  int rows_per_period = 0;
  double cycle_s = 0.0;
  // A column per joint. torque_share is NaN if the drive doesn't report its torque.
  Eigen::MatrixXd motor_rad, torque_share;
  Eigen::MatrixXd reading_S;  // N, Nm
  int rows = 0;               // number of rows read so far
  int stale = 0;              // number of cycles in which a drive didn't answer

  [[nodiscard]] double base_Hz() const noexcept { return 1.0 / (rows_per_period * cycle_s); }
  [[nodiscard]] bool whole() const noexcept { return rows == static_cast<int>(motor_rad.rows()); }
};

// Returns the lines of the fast motion as multiples of the base frequency. At least 12 controller cycles fall in one
// period of the highest line.
std::vector<int> fast_lines(int rows_per_period, double cycle_s);

// Returns two motions for each joint, about the motors' angles `motor_rad`. Throws SetupError if a joint has no room to
// move.
std::vector<JointMotion> joint_motions(const description::Cell& cell, const models::Arm& arm,
                                       const models::JointVector& motor_rad, double cycle_s);

std::string text(const std::vector<JointMotion>& motions, const models::Arm& arm, double cycle_s);

class JointExercise final : public proof::Exercise {
 public:
  // Precondition: `cell` and `arm` outlive this object.
  JointExercise(const description::Cell& cell, const models::Arm& arm, double cycle_s);

  // Returns a station for each motion and allocates its record. Throws SetupError as joint_motions() does.
  std::vector<proof::Station> stations(const models::JointVector& motor_rad);

  [[nodiscard]] models::JointVector offset_rad(std::size_t station, double time_s) const noexcept override;
  [[nodiscard]] double lasts_s(std::size_t station) const noexcept override;
  void take(std::size_t station, double time_s, const proof::Exercised& cycle) noexcept override;

  [[nodiscard]] const std::vector<MotionRecord>& records() const noexcept { return records_; }

 private:
  const description::Cell& cell_;
  const models::Arm& arm_;
  double cycle_s_;
  std::vector<MotionRecord> records_;
};

}  // namespace proxarm::identification
