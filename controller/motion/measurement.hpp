// All measurements of a cycle: the arm's position by its encoders, and the hand's wrench by the sensor.
//
// Encoders sit on the motors, and gravity twists the gears between motors and links. The twist of the last cycle is
// subtracted, so its error is at most its change in a cycle:
//   q(k) = θ(k) − (θ_g(q(k−1)) − q(k−1)),   θ_g: motor angles that hold the arm at rest (Arm::motor_from_link)
// A joint's speed is low-passed over two feedback periods of its drive, since drives on Modbus answer less often than
// once a cycle.
//
// Without a new sample, the last one is used again. No allocation, lock or throw after construction.
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

// Noise and bias of the sensor, found by the tare, and the drift of the bias since then.
struct SensorBias {
  // Standard deviation of a sample, in the noisiest axis. If it isn't white, only its changes from sample to sample
  // count, so that a trembling hand during the tare doesn't hide the hand's later forces.
  double noise_N = 0.0;
  bool noise_is_white = true;  // successive samples are independent: nobody moved the handle
  double samples = 0.0;        // number of averaged samples
  double sample_cycles = 1.0;
  double drift_N = 0.0;  // drift of the bias while nobody held the handle
  // The tare's mean less the known zero: drift, or a force on the handle during the tare. Zero if no zero is known.
  models::Vec3 beside_zero_S = models::Vec3::Zero();
};

struct AnswerTimes {
  models::JointVector unheard_cycles;  // of each drive: cycles before this one without an answer
  models::JointVector period_s;        // of each drive's answers; 0: every cycle
};

// The measurements of one cycle. Joint vectors and joint bits are in the order of the arm's joints.
struct Measured {
  // By the encoders:
  models::JointVector motor_rad, link_rad;
  models::JointVector moved_rad;  // change of the motor angles per cycle, low-passed
  models::JointVector jump_rad;   // change of the motor angles since the last cycle
  AnswerTimes answers;
  models::JointVector drive_target_rad;   // each drive's last setpoint; its position if it takes none
  models::JointVector gear_torque_Nm;     // of each gear on its link, if the drive measures it; else 0
  std::uint8_t fresh = 0, following = 0;  // drives that answered in this cycle; drives that take setpoints

  models::Vec3 tool_W = models::Vec3::Zero();
  double elbow_moved_m = 0.0;  // since the last cycle: largest, from the third joint on
  models::Mat3 R_WS = models::Mat3::Identity();

  // By the sensor:
  bool sample_is_new = false;
  models::Wrench reading_S;
  SensorBias bias;
  models::Wrench hand_W;  // about the rendered point, without bias and tool weight

  [[nodiscard]] Eigen::Index axes() const noexcept { return motor_rad.size(); }
};

class Measurement {
 public:
  // Precondition: the references outlive this object.
  Measurement(std::span<const DriveOnBus> drives, const fieldbus::ForceSensor& sensor, const models::Arm& arm,
              const WrenchCompensation& compensation, double period_s);

  // Precondition: all frames of this cycle have been received.
  void take() noexcept;
  [[nodiscard]] const Measured& now() const noexcept { return state_.measured; }

  // Adds this cycle's reading, if new, to the average that becomes the bias. Precondition: the arm is at rest.
  void add_tare_sample() noexcept;
  [[nodiscard]] double tare_spread_N() const noexcept { return compensation_.tare_spread_N(); }
  // Takes the average as the bias from this cycle on.
  void finish_tare() noexcept;
  // One cycle of taring. Returns true when the tare is complete. Raises force_at_start if the handle moved or drift
  // doesn't explain the mean, force_jumped if the reading jumped.
  [[nodiscard]] bool tare(const SessionSettings& settings, double tared_for_s, Alarm& alarm) noexcept;
  void start_tare() noexcept;
  // The present bias, and the tare's results.
  [[nodiscard]] const WrenchCompensation& compensation() const noexcept { return compensation_; }

  // Adds the reading of an empty handle at rest, rest_W, gradually to the bias. Precondition: nobody holds the handle.
  void follow_bias(const models::Wrench& rest_W) noexcept;

  // Sets the tool behind the sensor, from the next reading on.
  void set_tool(const HeldTool& tool) noexcept { compensation_.set_tool(tool.mass_kg, tool.centre_S); }
  // The evidence for judging new figures of the tool, as if the change to the `wanted` ones were already complete.
  [[nodiscard]] ToolEvidence tool_evidence(const HeldTool& wanted, const SessionSettings& settings) const noexcept;

  // Sets the period of the following cycles; converts counts of cycles.
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
  [[nodiscard]] double tare_error_N() const noexcept;  // upper bound, from the noise
  void read_encoders() noexcept;
  void place_elbow() noexcept;
  void read_sensor() noexcept;

  std::span<const DriveOnBus> drives_;
  const fieldbus::ForceSensor& sensor_;
  const models::Arm& arm_;
  WrenchCompensation compensation_;
  double period_s_;
  models::ToolKinematics kinematics_;  // of the links
  models::ArmPoints points_;           // of the links
  State state_;
};

}  // namespace proxarm::controller
