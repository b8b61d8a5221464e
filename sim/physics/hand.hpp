// The person's hand in a simulation: it holds the handle through stiffness and damping and follows an intention.
//
//   F = K (x_int(t) − x) + D (ẋ_int(t) − ẋ) + F_data(t),   cut to max_force_N along itself
// acts on hand and handle at T; x_int is the intention of description::HandDescription from where the tool was at the
// start. Between the rows of a trajectory, x_int is a cubic through their places with the slopes of parabolas through
// three of them (Hermite); F_data is straight between those of a force. With a grip on the orientation,
//   τ = K_r log(R_int(t) Rᵀ) + D_r (ω_int(t) − ω),   R_int = exp([φ(t)]ₓ) R_start,   cut to max_torque_Nm along itself
// acts as well. K, D, K_r and D_r vary together, where the description says so. The hand's mass and inertia belong to
// ArmDynamics.
#pragma once

#include "models/description/hand.hpp"
#include "models/geometry/geometry.hpp"

namespace proxarm::sim {

struct Intention {
  models::Vec3 position_W = models::Vec3::Zero();
  models::Vec3 velocity_W = models::Vec3::Zero();
  models::Vec3 turn_W = models::Vec3::Zero();       // φ, a rotation vector from the orientation of the start
  models::Vec3 turn_rate_W = models::Vec3::Zero();  // dφ/dt
};

class Hand {
 public:
  // `start_W`: the pose of T at the start.
  Hand(const description::HandDescription& description, const models::Pose& start_W);

  // What the hand wants at this time, in seconds of its own clock; before 0 it rests at its first waypoint.
  [[nodiscard]] Intention intention(double time_s) const noexcept;
  [[nodiscard]] models::Vec3 force_W(double time_s, const models::Vec3& position_W,
                                     const models::Vec3& velocity_W) const noexcept;
  [[nodiscard]] models::Vec3 torque_W(double time_s, const models::Mat3& R_WT,
                                      const models::Vec3& angular_velocity_W) const noexcept;
  [[nodiscard]] double mass_kg() const noexcept { return description_.mass_kg; }
  [[nodiscard]] const description::HandDescription& description() const noexcept { return description_; }

 private:
  [[nodiscard]] description::Grip grip(double time_s) const noexcept;
  [[nodiscard]] double variation(double time_s) const noexcept;  // a factor of the grip
  void add_waypoints(double time_s, Intention& want) const noexcept;
  void add_trajectory(double time_s, Intention& want) const noexcept;
  [[nodiscard]] models::Vec3 data_force_W(double time_s) const noexcept;

  description::HandDescription description_;
  models::Vec3 start_W_;
  models::Mat3 R_start_;
};

}  // namespace proxarm::sim
