// What of the sensor's reading a hand can have made, and where it acts.
//
// The sensor reads  hand's wrench + weight and inertia of the tool behind it + zero. Weight and zero are off before
// (motion/wrench_compensation.hpp). Here the tool's inertia is taken off: whatever the arm does with the tool, nobody
// at the handle reads as nothing. The proxy renders the reading as it is, for it feels the tool's mass as its own; all
// that asks "is that a hand?" (empty_handle.hpp, force_plausibility.hpp) asks it of this wrench.
//
// The tool's acceleration is the proxy's behind three equal first-order lags, which together are as long as the way
// from the proxy to the steel: filter of the setpoints, drives, two periods. Encoders would tell it as well, but their
// counts, differentiated twice, may read as more than the hand of a child. What is left is the gears' ringing.
//
// A force acts at the handle if its line passes the handle's point: |τ| <= r |F|. A load or a hand may do so; an offset
// of the sensor does so by chance alone, since it has no lever: τ = −p × F, p being the handle from the sensor. So a
// force acts at the handle if its torque is at most a third of that, too. It can be told where |p × F| is three times
// what isn't known of τ.
//
// It acts as an offset if its line passes the sensor's origin, as well as that can be told.
//
// A hand that pushed while the sensor was tared, and was taken for its zero, leaves the opposite of its force when it
// lets go, and that acts at the handle as it did. So a force that is what the tare differs from the known zero by is
// none that can be told.
//
// Neither allocates, locks nor throws.
#pragma once

#include <algorithm>

#include "models/base/archive_fields.hpp"
#include "models/geometry/geometry.hpp"

namespace proxarm::controller {

// What moves behind the sensor.
struct HeldTool {
  double mass_kg = 0.0;
  models::Vec3 centre_S = models::Vec3::Zero();  // of mass, from S's origin
  models::Vec3 handle_S = models::Vec3::Zero();  // the handle's point T, from S's origin
};

// How far beside the handle's point a load's line of action may pass. A hand's is a few millimetres to centimetres off;
// an offset's is as far off as the handle is from the sensor.
inline constexpr double beside_handle_m = 0.02;
// How well a force's line is known: a sensor that is mounted 1 degree off, and a handle that is 2 mm from where the
// cell has it, make 4 mm at 0.1 m.
inline constexpr double known_line_m = 0.004;
// A sensor's noise of torque is at most this times that of its force.
inline constexpr double noise_lever_m = 0.1;

// Whether a wrench about T's origin acts at the handle, and not as an offset of the sensor would. `handle` is from the
// sensor, in the wrench's frame; `noise_N` is the standard deviation of the force.
inline bool acts_at_handle(const models::Wrench& wrench, const models::Vec3& handle, double noise_N) noexcept {
  constexpr double deviations = 4.0, telling = 3.0;
  const double force_N = wrench.force.norm(), noise_Nm = deviations * noise_lever_m * noise_N;
  const double offset_Nm = handle.cross(wrench.force).norm();
  if (!(force_N > 0.0 && offset_Nm >= telling * std::max(known_line_m * force_N, noise_Nm))) return false;
  return wrench.torque.norm() <= std::min(beside_handle_m * force_N, offset_Nm / telling) + noise_Nm;
}

// Whether a wrench about T's origin acts at the sensor's origin, as its offset does.
inline bool acts_as_offset(const models::Wrench& wrench, const models::Vec3& handle, double noise_N) noexcept {
  constexpr double deviations = 4.0, telling = 3.0;
  const double known_Nm = std::max(known_line_m * wrench.force.norm(), deviations * noise_lever_m * noise_N);
  const models::Vec3 offset = handle.cross(wrench.force);
  return offset.norm() >= telling * known_Nm && (wrench.torque + offset).norm() <= known_Nm;
}

class HandForce {
 public:
  // `lag_s`: from the proxy to the steel.
  HandForce(const HeldTool& tool, double lag_s, double period_s) noexcept
      : tool_(tool), lag_s_(lag_s), period_s_(period_s) {}

  void start() noexcept { state_ = {}; }
  // The lag depends on the period, too.
  void set_period(double period_s, double lag_s) noexcept {
    period_s_ = period_s;
    lag_s_ = lag_s;
  }
  void set_tool(const HeldTool& tool) noexcept { tool_ = tool; }
  // Once in each cycle. reading_W: about T's origin, without bias and tool weight; v_W: the proxy's, in its last step;
  // beside_zero_S: by which the tare differs from the known zero.
  void step(const models::Wrench& reading_W, const models::Mat3& R_WS, const models::Vec3& v_W, double noise_N,
            const models::Vec3& beside_zero_S) noexcept;

  // Without the tool's inertia.
  [[nodiscard]] const models::Wrench& wrench_W() const noexcept { return state_.wrench_W; }
  // What moves it acts at the handle, as a load or a hand does, and is large enough to tell.
  [[nodiscard]] bool at_handle() const noexcept { return state_.at_handle; }
  // What moves it acts at the sensor's origin, and is large enough to tell.
  [[nodiscard]] bool as_offset() const noexcept { return state_.as_offset; }
  // It is what a hand that is gone left in the tare.
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
