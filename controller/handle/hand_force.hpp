// Computes the part of the sensor's reading that a hand can have made, and judges at which point the hand's force acts.
//
// The sensor reads  hand's wrench + weight and inertia of the tool behind the sensor + zero.
// motion/wrench_compensation.hpp removes weight and zero; HandForce removes the tool's inertia, so that an empty handle
// reads zero however the arm moves. Only the checks whether a hand has made a force (empty_handle.hpp,
// force_plausibility.hpp) use this wrench. The proxy gets the wrench with the tool's inertia, so the hand feels the
// tool's mass.
//
// Three equal first-order lags estimate the tool's acceleration from the proxy's acceleration. The three time constants
// add up to the delay from the proxy to the real arm: setpoint filter, drives and two periods. Encoders can't replace
// this estimate: their counts, differentiated twice, may look like more than a child's force. The estimate doesn't
// contain the gears' oscillation, so the inertial force of this oscillation remains in the wrench.
//
// A force F with torque τ about the handle's point acts at the handle if its line passes close to this point: |τ| ≤ r
// |F|. The force of a hand or a load does so. A sensor's offset has no lever about the sensor: τ = −p × F, where p is
// the handle's position from the sensor. To tell a force from an offset, |τ| must also be at most a third of |p × F|,
// and |p × F| must be at least three times the uncertainty of τ. A force acts as an offset if its line passes the
// sensor's origin, within this uncertainty.
//
// A hand that pushes during the tare makes its force part of the zero. When the hand lets go, the opposite of its force
// remains in the reading, and acts at the handle. So a force that equals the known zero less the tare counts neither as
// acting at the handle nor as an offset.
//
// No function allocates, locks or throws.
#pragma once

#include <algorithm>

#include "models/base/archive_fields.hpp"
#include "models/geometry/geometry.hpp"

namespace proxarm::controller {

// The mass behind the sensor.
struct HeldTool {
  double mass_kg = 0.0;
  models::Vec3 centre_S = models::Vec3::Zero();  // centre of mass, from S's origin
  models::Vec3 handle_S = models::Vec3::Zero();  // handle point T, from S's origin
};

// r, the largest distance at which a load's line of action may pass the handle's point. The line of a hand's force
// passes it at a few millimetres to centimetres, the line of an offset at the distance from handle to sensor.
inline constexpr double beside_handle_m = 0.02;
// Uncertainty of the place of a force's line. A sensor that is mounted 1 degree off and a handle that is 2 mm from its
// place in the cell file give 4 mm, if the handle is 0.1 m from the sensor.
inline constexpr double known_line_m = 0.004;
// A sensor's torque noise is at most this lever times its force noise.
inline constexpr double noise_lever_m = 0.1;

// Whether a wrench about T's origin acts at the handle, unlike a sensor's offset. `handle`: the handle's position from
// the sensor, in the wrench's frame. `noise_N`: standard deviation of the force.
inline bool acts_at_handle(const models::Wrench& wrench, const models::Vec3& handle, double noise_N) noexcept {
  constexpr double deviations = 4.0, telling = 3.0;
  const double force_N = wrench.force.norm(), noise_Nm = deviations * noise_lever_m * noise_N;
  const double offset_Nm = handle.cross(wrench.force).norm();
  if (!(force_N > 0.0 && offset_Nm >= telling * std::max(known_line_m * force_N, noise_Nm))) return false;
  return wrench.torque.norm() <= std::min(beside_handle_m * force_N, offset_Nm / telling) + noise_Nm;
}

// Whether a wrench about T's origin acts at the sensor's origin, like a sensor's offset. Arguments: see
// acts_at_handle().
inline bool acts_as_offset(const models::Wrench& wrench, const models::Vec3& handle, double noise_N) noexcept {
  constexpr double deviations = 4.0, telling = 3.0;
  const double known_Nm = std::max(known_line_m * wrench.force.norm(), deviations * noise_lever_m * noise_N);
  const models::Vec3 offset = handle.cross(wrench.force);
  return offset.norm() >= telling * known_Nm && (wrench.torque + offset).norm() <= known_Nm;
}

class HandForce {
 public:
  // `lag_s`: delay from the proxy to the real arm.
  HandForce(const HeldTool& tool, double lag_s, double period_s) noexcept
      : tool_(tool), lag_s_(lag_s), period_s_(period_s) {}

  void start() noexcept { state_ = {}; }
  // Sets the period, and the lag, which depends on the period.
  void set_period(double period_s, double lag_s) noexcept {
    period_s_ = period_s;
    lag_s_ = lag_s;
  }
  void set_tool(const HeldTool& tool) noexcept { tool_ = tool; }
  // Call once per cycle. reading_W: the reading about T's origin, without bias and tool weight. v_W: the proxy's
  // velocity in its last step. beside_zero_S: the tare less the known zero.
  void step(const models::Wrench& reading_W, const models::Mat3& R_WS, const models::Vec3& v_W, double noise_N,
            const models::Vec3& beside_zero_S) noexcept;

  // The hand's wrench without the tool's inertia.
  [[nodiscard]] const models::Wrench& wrench_W() const noexcept { return state_.wrench_W; }
  // The force acts at the handle, like a hand's or a load's force, and is large enough to decide this.
  [[nodiscard]] bool at_handle() const noexcept { return state_.at_handle; }
  // The force acts at the sensor's origin, and is large enough to decide this.
  [[nodiscard]] bool as_offset() const noexcept { return state_.as_offset; }
  // The force is left over from a hand that pushed during the tare.
  [[nodiscard]] bool left_by_tare() const noexcept { return state_.left_by_tare; }
  [[nodiscard]] double tool_mass_kg() const noexcept { return tool_.mass_kg; }

  void archive(fieldbus::StateArchive& state) noexcept { archive_fields(state, state_); }

 private:
  struct State {
    models::Wrench wrench_W, calm_W;  // calm_W: behind a low-pass
    models::Vec3 v_k1_W = models::Vec3::Zero();
    models::Vec3 a1_W = models::Vec3::Zero(), a2_W = models::Vec3::Zero(), a3_W = models::Vec3::Zero();
    bool at_handle = false, as_offset = false, left_by_tare = false;
  };

  HeldTool tool_;
  double lag_s_, period_s_;
  State state_;
};

}  // namespace proxarm::controller
