// Takes all measurements of a cycle: the arm's position by the encoders, and the hand's wrench by the sensor.
//
// Encoders sit on the motors, and gravity twists the gears between motors and links. The link angles q are the motor
// angles θ less the twist of the last cycle, so the error of q is at most the twist's change in a cycle:
//   q(k) = θ(k) − (θ_g(q(k−1)) − q(k−1)),   θ_g: motor angles that hold the arm at rest (Arm::motor_from_link)
// A joint's speed is low-passed over two feedback periods of its drive, since drives on Modbus answer less often than
// once a cycle.
//
// In a cycle without a new sample of the sensor, the last sample is used again. Nothing allocates, locks or throws
// after construction.
#pragma once

#include <cstdint>
#include <span>

#include "controller/motion/cycle_parts.hpp"
#include "controller/motion/tool_change.hpp"
#include "controller/motion/wrench_compensation.hpp"
#include "controller/rendering/session_settings.hpp"
#include "controller/supervision/alarm.hpp"
#include "fieldbus/sensors/force_sensor.hpp"
#include "models/arm/arm.hpp"
#include "models/base/archive_fields.hpp"

namespace proxarm::controller {

// The sensor's noise and bias, found by the tare, and the bias's drift since the tare.
struct SensorBias {
  // Standard deviation of a sample, in the noisiest axis. If the noise isn't white, noise_N is at most the value
  // computed from the changes between successive samples. So a hand that trembles during the tare doesn't hide the
  // hand's later forces.
  double noise_N = 0.0;
  bool noise_is_white = true;  // successive samples are independent: nobody moved the handle
  double samples = 0.0;        // number of averaged samples
  double sample_cycles = 1.0;  // cycles from one sample to the next
  double drift_N = 0.0;        // drift of the bias while nobody held the handle
  // The tare's mean less the known zero: drift, or a force on the handle during the tare. Zero if no zero is known.
  models::Vec3 beside_zero_S = models::Vec3::Zero();
};

struct AnswerTimes {
  models::JointVector unheard_cycles;  // for each drive: number of cycles without an answer, this cycle not counted
  models::JointVector period_s;        // for each drive: time from answer to answer; 0: it answers in every cycle
};

// The measurements of one cycle. Joint vectors and joint bits are in the order of the arm's joints.
struct Measured {
  // By the encoders:
  models::JointVector motor_rad, link_rad;
  models::JointVector moved_rad;  // change of the motor angles per cycle, low-passed
  models::JointVector jump_rad;   // change of the motor angles since the last cycle
  AnswerTimes answers;
  models::JointVector drive_target_rad;  // each drive's last setpoint; without setpoints: the drive's position
  models::JointVector gear_torque_Nm;    // torque of each gear on its link, if the drive measures it; else 0
  // fresh: bits of the drives that answered in this cycle. following: bits of the drives that take setpoints.
  std::uint8_t fresh = 0, following = 0;

  models::Vec3 tool_W = models::Vec3::Zero();
  double elbow_moved_m = 0.0;  // largest distance that a joint from the third on has moved since the last cycle
  models::Mat3 R_WS = models::Mat3::Identity();

  // By the sensor:
  bool sample_is_new = false;
  models::Wrench reading_S;
  SensorBias bias;
  models::Wrench hand_W;  // the hand's wrench about the rendered point, without bias and tool weight

  [[nodiscard]] Eigen::Index axes() const noexcept { return motor_rad.size(); }
};

class Measurement {
 public:
  // Precondition: the drives, the sensor and the arm outlive this object.
  Measurement(std::span<const DriveOnBus> drives, const fieldbus::ForceSensor& sensor, const models::Arm& arm,
              const WrenchCompensation& compensation, double period_s);

  // Takes this cycle's measurements. Precondition: all frames of this cycle have been received.
  void take() noexcept;
  [[nodiscard]] const Measured& now() const noexcept { return state_.measured; }

  // Adds this cycle's reading, if new, to the average that becomes the bias. Precondition: the arm is at rest.
  void add_tare_sample() noexcept;
  [[nodiscard]] double tare_spread_N() const noexcept { return compensation_.tare_spread_N(); }
  // Makes the average the bias from this cycle on.
  void finish_tare() noexcept;
  // One cycle of taring. Returns true when the tare is complete without a fault. Raises force_at_start if the handle
  // moved or drift doesn't explain the mean, force_jumped if the reading jumped.
  [[nodiscard]] bool tare(const SessionSettings& settings, double tared_for_s, Alarm& alarm) noexcept;
  void start_tare() noexcept;
  // The present bias, and the tare's results.
  [[nodiscard]] const WrenchCompensation& compensation() const noexcept { return compensation_; }

  // Adds rest_W, the reading of an empty handle at rest, gradually to the bias. Precondition: nobody holds the handle.
  void follow_bias(const models::Wrench& rest_W) noexcept;

  // Sets the tool behind the sensor, from the next reading on.
  void set_tool(const HeldTool& tool) noexcept { compensation_.set_tool(tool.mass_kg, tool.centre_S); }
  // Returns the evidence for judging new figures of the tool, as if the present change to the figures `wanted` were
  // complete.
  [[nodiscard]] ToolEvidence tool_evidence(const HeldTool& wanted, const SessionSettings& settings) const noexcept;

  // Sets the period of the following cycles. Converts values that are counted in cycles.
  void set_period(double period_s) noexcept;
  void archive(fieldbus::StateArchive& state) noexcept {
    archive_fields(state, state_);
    state(compensation_);
    for (models::Vec3& place_W : points_.joint_W) state(place_W);
  }

 private:
  struct State {
    Measured measured;
    models::JointVector stale_cycles;  // cycles since each drive's last position
    double tare_cycles = 0.0;
  };

  [[nodiscard]] double standing_limit_N(const SessionSettings& settings) const noexcept;
  [[nodiscard]] double tare_error_N() const noexcept;  // upper bound of the error that noise leaves in the tared bias
  void read_encoders() noexcept;
  void place_elbow() noexcept;
  void read_sensor() noexcept;

  std::span<const DriveOnBus> drives_;
  const fieldbus::ForceSensor& sensor_;
  const models::Arm& arm_;
  WrenchCompensation compensation_;
  double period_s_;
  models::ToolKinematics kinematics_;  // kinematics at the measured link angles
  models::ArmPoints points_;           // the arm's points at the measured link angles
  State state_;
};

}  // namespace proxarm::controller
