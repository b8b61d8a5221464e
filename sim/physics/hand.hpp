// The person's hand in simulation. It holds the handle by a spring and a damper, and follows an intended motion.
//
// The force on hand and handle at T, with its norm limited to max_force_N, is
//   F = K (x_int(t) − x) + D (ẋ_int(t) − ẋ) + F_data(t)
// x_int is the intention of description::HandDescription, relative to the tool's start. Between the rows of a
// trajectory, x_int is a cubic Hermite spline whose slopes are those of parabolas through three rows. F_data is
// interpolated linearly between its rows.
//
// If the hand also grips the orientation, the torque on hand and handle, with its norm limited to max_torque_Nm, is
//   τ = K_r log(R_int(t) Rᵀ) + D_r (ω_int(t) − ω),   R_int = exp([φ(t)]ₓ) R_start
// If the description has a variation of the grip, K, D, K_r and D_r vary by the same factor. ArmDynamics has the hand's
// mass and inertia.
#pragma once

#include "models/description/hand.hpp"
#include "models/geometry/geometry.hpp"

namespace proxarm::sim {

struct Intention {
  models::Vec3 position_W = models::Vec3::Zero();
  models::Vec3 velocity_W = models::Vec3::Zero();
  models::Vec3 turn_W = models::Vec3::Zero();       // φ, rotation vector from the orientation at the start
  models::Vec3 turn_rate_W = models::Vec3::Zero();  // dφ/dt
};

class Hand {
 public:
  // `start_W` is the pose of T at the start.
  Hand(const description::HandDescription& description, const models::Pose& start_W);

  // `time_s` is the time on the hand's clock. Before 0, the hand rests at its first waypoint.
  [[nodiscard]] Intention intention(double time_s) const noexcept;
  [[nodiscard]] models::Vec3 force_W(double time_s, const models::Vec3& position_W,
                                     const models::Vec3& velocity_W) const noexcept;
  [[nodiscard]] models::Vec3 torque_W(double time_s, const models::Mat3& R_WT,
                                      const models::Vec3& angular_velocity_W) const noexcept;
  [[nodiscard]] double mass_kg() const noexcept { return description_.mass_kg; }
  [[nodiscard]] const description::HandDescription& description() const noexcept { return description_; }

 private:
  [[nodiscard]] description::Grip grip(double time_s) const noexcept;
  [[nodiscard]] double variation(double time_s) const noexcept;  // factor on the grip's stiffness and damping
  void add_waypoints(double time_s, Intention& want) const noexcept;
  void add_trajectory(double time_s, Intention& want) const noexcept;
  [[nodiscard]] models::Vec3 data_force_W(double time_s) const noexcept;

  description::HandDescription description_;
  models::Vec3 start_W_;
  models::Mat3 R_start_;
};

}  // namespace proxarm::sim
