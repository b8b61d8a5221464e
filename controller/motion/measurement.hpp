// Where the arm is, by its encoders, and what the hand does, by the sensor: all that a cycle knows before it decides.
//
// Encoders sit on the motors, and gravity twists the gears between motors and links. The twist of the last cycle is
// used, which is off by its change in one cycle at most. So the links are at
//   q(k) = θ(k) − (θ_g(q(k−1)) − q(k−1)),   θ_g: motor angles that hold the arm at rest (Arm::motor_from_link)
// A joint's speed is a low-pass over two feedback periods of its drive, since drives on Modbus answer less often than
// the cycle asks.
//
// If there is no new sample, the last one is used again. Nothing allocates, locks or throws after construction.
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

// What taring the sensor has shown of its noise and bias, and how the bias has drifted since.
struct SensorBias {
  // Standard deviation of a sample, in the noisiest axis; where it isn't white, what of it changes from sample to
  // sample: a hand that trembled meanwhile doesn't make the session deaf.
  double noise_N = 0.0;
  bool noise_is_white = true;  // each sample is independent of the one before: nobody moved the handle
  double samples = 0.0;        // the number of samples that the bias is the mean of
  double sample_cycles = 1.0;  // cycles from one sample to the next
  double drift_N = 0.0;        // how far the bias has drifted while nobody held the handle
  // By which the tare's mean differs from the known zero: drift, or what stood at the handle and was taken for zero.
  // Zero where none is known.
  models::Vec3 beside_zero_S = models::Vec3::Zero();
};

// When drives answer.
struct AnswerTimes {
  models::JointVector unheard_cycles;  // cycles without an answer of each drive, up to this one
  models::JointVector period_s;        // of each drive's answers; 0: in every cycle
};

// The measurements of one cycle. Joint vectors and bits of joints are in the order of the arm's joints.
struct Measured {
  // By the encoders:
  models::JointVector motor_rad, link_rad;
  models::JointVector moved_rad;  // change of the motors' angles per cycle, low-pass of the drives' answers
  models::JointVector jump_rad;   // change of the motors' angles since the cycle before
  AnswerTimes answers;
  models::JointVector drive_target_rad;   // each drive's last setpoint; its position if it takes none
  models::JointVector gear_torque_Nm;     // of each gear on its link, where the drive measures it; 0 elsewhere
  std::uint8_t fresh = 0, following = 0;  // drives that have answered in this cycle, and drives that take setpoints

  models::Vec3 tool_W = models::Vec3::Zero();
  double elbow_moved_m = 0.0;  // since the cycle before: the furthest of the joints from the third on
  models::Mat3 R_WS = models::Mat3::Identity();

  // By the sensor:
  bool sample_is_new = false;
  models::Wrench reading_S;
  SensorBias bias;
  models::Wrench hand_W;  // without bias and the tool's weight, about the rendered point

  [[nodiscard]] Eigen::Index axes() const noexcept { return motor_rad.size(); }
};

class Measurement {
 public:
  // Precondition: all but the compensation outlive this object.
  Measurement(std::span<const DriveOnBus> drives, const fieldbus::ForceSensor& sensor, const models::Arm& arm,
              const WrenchCompensation& compensation, double period_s);

  // Precondition: everything that this cycle receives has been received.
  void take() noexcept;
  [[nodiscard]] const Measured& now() const noexcept { return state_.measured; }

  // Adds this cycle's reading, if it is new, to the average that becomes the sensor's bias. Precondition: the arm is at
  // rest.
  void add_tare_sample() noexcept;
  [[nodiscard]] double tare_spread_N() const noexcept { return compensation_.tare_spread_N(); }
  // Takes the average as the bias, from this cycle on.
  void finish_tare() noexcept;
  // One cycle of taring. Returns true once it is over and nothing was wrong with it; what was, a handle that moved or
  // a mean that the sensor's drift doesn't explain, raises force_at_start.
  [[nodiscard]] bool tare(const SessionSettings& settings, double tared_for_s, Alarm& alarm) noexcept;
  void start_tare() noexcept;
  // The bias as it is followed, and of what the tare has shown.
  [[nodiscard]] const WrenchCompensation& compensation() const noexcept { return compensation_; }

  // Precondition: nobody holds the handle. The hand's wrench as it is read, rest_W, is then bias, and is added to it
  // gradually.
  void follow_bias(const models::Wrench& rest_W) noexcept;

  // The tool behind the sensor, from the next reading on.
  void set_tool(const HeldTool& tool) noexcept { compensation_.set_tool(tool.mass_kg, tool.centre_S); }
  // By which other figures of the tool are judged, as if those that are `wanted` now had been faded in.
  [[nodiscard]] ToolEvidence tool_evidence(const HeldTool& wanted, const SessionSettings& settings) const noexcept;

  // The period of the cycles to come. What is counted in cycles is converted to the new ones.
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
  [[nodiscard]] double tare_error_N() const noexcept;  // at most, by its noise
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
