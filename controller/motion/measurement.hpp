// Where the arm is by its encoders, and what the hand does by the sensor: what a cycle knows before it decides.
//
// Encoders sit on the motors. Gravity twists the gears; the twist of the last cycle is right to within a cycle's change
// of it, so the links are at
//   q(k) = θ(k) − (θ_g(q(k−1)) − q(k−1)),   θ_g: motor angles that hold the arm at rest (Arm::motor_from_link)
// How fast a joint moves is a low-pass over two periods of its drive's feedback, since drives on Modbus answer more
// seldom than the cycle asks.
//
// Where there is no new sample the last one counts on. Nothing allocates, locks or throws after construction.
#pragma once

#include <cstdint>
#include <span>

#include "controller/motion/cycle_parts.hpp"
#include "controller/motion/wrench_compensation.hpp"
#include "fieldbus/sensors/force_sensor.hpp"
#include "models/arm/arm.hpp"
#include "models/base/archive_fields.hpp"

namespace proxarm::controller {

// What taring the sensor has told of it, and what its bias did since.
struct SensorBias {
  double noise_N = 0.0;        // standard deviation of a sample, in the noisiest axis
  bool noise_is_white = true;  // nobody moved the handle meanwhile
  double samples = 0.0;        // that the bias is the mean of
  double sample_cycles = 1.0;  // from one to the next
  double drift_N = 0.0;        // by which it has gone while nobody held the handle
};

// Of one cycle. Joint vectors are in the order of the arm's joints, bits of joints too.
struct Measured {
  // By the encoders.
  models::JointVector motor_rad, link_rad;
  models::JointVector moved_rad;          // of the motors, per cycle, as far as the drives' answers tell
  models::JointVector jump_rad;           // of the motors, since the cycle before
  models::JointVector unheard_cycles;     // that came before this one without an answer of the drive
  models::JointVector feedback_period_s;  // of each drive; 0: it answers every cycle
  models::JointVector drive_target_rad;   // where each drive was last told to be; unless it follows, where it is
  std::uint8_t fresh = 0, following = 0;  // drives that have answered in this cycle, and that take targets

  models::Vec3 tool_W = models::Vec3::Zero();
  double elbow_moved_m = 0.0;  // since the cycle before: the furthest of the joints from the third on
  models::Mat3 R_WS = models::Mat3::Identity();

  // By the sensor.
  bool sample_is_new = false;
  models::Wrench reading_S;
  SensorBias bias;
  models::Wrench hand_W;  // bias and tool weight taken off, about the rendered point

  [[nodiscard]] Eigen::Index axes() const noexcept { return motor_rad.size(); }
};

class Measurement {
 public:
  // All but the compensation must outlive this.
  Measurement(std::span<const DriveOnBus> drives, const fieldbus::ForceSensor& sensor, const models::Arm& arm,
              const WrenchCompensation& compensation, double period_s);

  // After all that this cycle receives.
  void take() noexcept;
  [[nodiscard]] const Measured& now() const noexcept { return state_.measured; }

  // Averages the reading of this cycle, where it is a new one, for the sensor's bias; the arm is at rest.
  void add_tare_sample() noexcept;
  [[nodiscard]] double tare_spread_N() const noexcept { return compensation_.tare_spread_N(); }
  // Takes the average as the bias, from this cycle on.
  void finish_tare() noexcept;

  // Nobody holds the handle, and this is what its wrench is read as: it goes into the bias by and by.
  void follow_bias(const models::Wrench& rest_W) noexcept;

  // T of the cycles to come; what is counted in cycles is counted in the new ones.
  void set_period(double period_s) noexcept;
  void archive(fieldbus::StateArchive& state) noexcept {
    archive_fields(state, state_);
    state(compensation_);
    for (models::Vec3& place_W : points_.joint_W) state(place_W);
  }

 private:
  struct State {
    Measured measured;
    models::JointVector stale_cycles;  // since each drive's position came
    double tare_cycles = 0.0;
  };

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
