// The mechanics of the simulated arm: links, gears, rotors, friction, brakes, handle and hand, stepped in time.
//
// Links by MuJoCo from the same URDF that the controller uses; the rotors are scalar equations beside it (Spong's
// reduced model of elastic joints: a rotor's spin about its own axis counts, its gyroscopic torque doesn't). With φ the
// link's angle and θ the motor's, as an angle at the joint:
//   M(φ) φ̈ + c(φ, φ̇) + g(φ) = τ_gear + Jᵀ F_hand                                                 (a)
//   J_r θ̈ = τ − τ_gear − b θ̇ − τ_friction,   |τ_friction| ≤ F_c                                   (b)
//   τ_gear = k δ + d δ̇,  δ = θ − φ; with backlash, δ less the dead band, and never against the flank in contact   (c)
// A motor's torque ripples: with A and n of the cell and N, the gear's ratio, τ is that of the drive and A sin(n N θ).
// A gear with hysteresis has a friction z in parallel to its spring (Dahl, "A solid friction model", 1968), whose loop
// is as wide as the cell says, w, where τ_gear is 0 after large swings:
//   τ_gear = k δ + d δ̇ + z,   dz/dδ = (k/2) (1 − sgn(δ̇) z/z_m),   z_m = k w/2                              (d)
// z is found exactly for a δ that goes one way within a step.
// In this form rotors are coupled to nothing but their own gear, so that Coulomb friction has an exact solution per
// axis: a stuck, braked or jammed rotor stays at its angle bit for bit (a friction constraint in MuJoCo creeps).
//
// Step: symplectic Euler with the rotor's friction implicit. Order 1 in time, but it conserves the energy of free
// oscillation on average, and the frequency of a mode ω is off by (ωh)²/24 only: 0.3 ppm at 16 Hz and h = 0.25 ms.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "models/description/cell.hpp"
#include "models/geometry/geometry.hpp"

namespace proxarm::sim {

// The true state of the rendered point T of the handle.
struct ToolState {
  models::Pose X_WT = models::Pose::Identity();
  models::Vec3 velocity_W = models::Vec3::Zero();              // of T's origin, m/s
  models::Vec3 acceleration_W = models::Vec3::Zero();          // of T's origin, m/s²
  models::Vec3 angular_velocity_W = models::Vec3::Zero();      // rad/s
  models::Vec3 angular_acceleration_W = models::Vec3::Zero();  // rad/s²
};

struct Energy {
  double kinetic_J = 0.0;    // links, rotors, handle, hand
  double potential_J = 0.0;  // gravity on links and handle
  double elastic_J = 0.0;    // gears
};

// The arm of a cell, its handle, and the mass of the hand that holds it (at T, with the same inertia about each axis,
// rigid with the handle; its weight is carried by the person, so gravity doesn't act on it).
//
// A step is advance(), then apply(): advance() goes to t + h with the accelerations found by the last apply();
// apply() takes the torques and the force that act from now on and finds accelerations and the sensor's wrench.
// Everything but the constructor and reset() is noexcept and allocates nothing.
class ArmDynamics {
 public:
  // Throws description::SetupError: unreadable or bad URDF, <mimic>, missing joint or link, joint without a drive.
  ArmDynamics(const description::Cell& cell, double hand_mass_kg, double step_s = 0.25e-3,
              double hand_inertia_kg_m2 = 0.0);
  ArmDynamics(const ArmDynamics&) = delete;
  ArmDynamics& operator=(const ArmDynamics&) = delete;
  ~ArmDynamics();

  // At rest with the links at these angles (one per drive, in the cell's order), gears wound up by gravity, motors
  // carrying it (static_torque_Nm), brakes closed.
  void reset(std::span<const double> joint_rad);

  void advance() noexcept;
  // Motor torques, as torques at the joint, and the force of the hand's muscles on hand and handle at T, in W.
  // `arm_force_W` acts at the same point on the arm in front of the sensor, which doesn't feel it. `hand_torque_W` is
  // the torque of the hand's muscles on hand and handle.
  void apply(std::span<const double> motor_torque_Nm, const models::Vec3& hand_force_W,
             const models::Vec3& arm_force_W = models::Vec3::Zero(),
             const models::Vec3& hand_torque_W = models::Vec3::Zero()) noexcept;

  // A jam holds the rotor where it is, at once and without limit; the gear stays elastic. So does a closed brake,
  // unless the cell says its torque: then it is dry friction of that torque, and a rotor that turns runs out.
  void brake(std::size_t axis, bool closed) noexcept { axes_[axis].braked = closed; }
  void jam(std::size_t axis, bool jammed) noexcept { axes_[axis].jammed = jammed; }
  [[nodiscard]] bool braked(std::size_t axis) const noexcept { return axes_[axis].braked; }

  [[nodiscard]] std::size_t axis_count() const noexcept { return axes_.size(); }
  [[nodiscard]] double step_s() const noexcept { return step_s_; }
  [[nodiscard]] double motor_angle_rad(std::size_t axis) const noexcept { return axes_[axis].angle_rad; }
  [[nodiscard]] double motor_speed_rad_per_s(std::size_t axis) const noexcept { return axes_[axis].speed_rad_per_s; }
  [[nodiscard]] double joint_angle_rad(std::size_t axis) const noexcept;  // link side of the gear
  [[nodiscard]] double joint_speed_rad_per_s(std::size_t axis) const noexcept;
  [[nodiscard]] double gear_torque_Nm(std::size_t axis) const noexcept { return axes_[axis].gear_torque_Nm; }
  // Motor torque that holds the links against gravity as they stand.
  [[nodiscard]] double static_torque_Nm(std::size_t axis) const noexcept;

  [[nodiscard]] const ToolState& tool() const noexcept { return tool_; }
  // What an ideal sensor between flange and handle reads: the load that handle and hand put on it, about S's origin.
  // At rest that is the handle's weight; a push along +x of S reads +x.
  [[nodiscard]] const models::Wrench& sensor_wrench_S() const noexcept { return sensor_S_; }
  // What the hand feels: force of the hand on the handle at T, the hand's own inertia taken off, in W.
  [[nodiscard]] models::Vec3 handle_force_W() const noexcept { return handle_force_W_; }
  // The same of the torque about T.
  [[nodiscard]] models::Vec3 handle_torque_W() const noexcept { return handle_torque_W_; }

  // For tests and for what is printed about an arm. These may allocate.
  [[nodiscard]] Energy energy() const;
  // (J M⁻¹ Jᵀ)⁻¹ at T with rotors, without the hand: what a hand moves when nothing controls the arm. Along W's axes.
  [[nodiscard]] models::Mat3 effective_mass_kg() const;
  // Undamped natural frequencies of the arm with its motors locked, rising; handle and hand included.
  [[nodiscard]] std::vector<double> locked_modes_Hz() const;

  // How near the step is to where the motion of links and rotors on their gears explodes: below 1 it doesn't.
  // Symplectic Euler, v(t+h) = v − h M⁻¹ (K q + C v), q(t+h) = q + h v(t+h), is M z² − (2M − hC − h²K) z + (M − hC).
  // For symmetric K, C ≥ 0 it leaves the unit circle at z = −1, where 4M − 2hC − h²K becomes singular: stable as long
  // as the largest eigenvalue of M⁻¹ (h²K + 2hC) is below 4, of which this is the share.
  [[nodiscard]] double step_share() const;

 private:
  struct Axis {
    int dof = 0;  // of the link in MuJoCo's model; hinges only, so also the index in qpos
    double rotor_inertia_kg_m2 = 0.0, coulomb_Nm = 0.0, viscous_Nms_per_rad = 0.0;
    double stiffness_Nm_per_rad = 0.0, damping_Nms_per_rad = 0.0, half_backlash_rad = 0.0;
    double hysteresis_rad = 0.0;                    // w of (d)
    double ripple_Nm = 0.0, ripple_per_rad = 0.0;   // A and n N
    double brake_Nm = 0.0;                          // 0: without limit
    double angle_rad = 0.0, speed_rad_per_s = 0.0;  // of the motor, as at the joint
    double torque_Nm = 0.0, gear_torque_Nm = 0.0;
    double gear_friction_Nm = 0.0, windup_rad = 0.0;  // z and δ of (d)
    bool braked = true, jammed = false;
  };
  struct Links;  // MuJoCo's model and data

  void update_kinematics() noexcept;
  void update_accelerations() noexcept;
  void update_tool_acceleration() noexcept;
  [[nodiscard]] double gear_torque(const Axis& axis) const noexcept;
  void rub(Axis& axis) noexcept;

  std::unique_ptr<Links> links_;
  std::vector<Axis> axes_;
  description::ToolDescription handle_;
  models::Pose X_WB_ = models::Pose::Identity();
  models::Pose X_ST_ = models::Pose::Identity();
  models::Vec3 gravity_W_ = models::Vec3::Zero();
  models::Mat3 handle_inertia_S_ = models::Mat3::Zero();  // about its centre of mass
  double hand_mass_kg_ = 0.0, hand_inertia_kg_m2_ = 0.0;
  double step_s_ = 0.0;
  models::Vec3 hand_force_W_ = models::Vec3::Zero();
  models::Vec3 arm_force_W_ = models::Vec3::Zero();
  models::Vec3 handle_force_W_ = models::Vec3::Zero();
  models::Vec3 hand_torque_W_ = models::Vec3::Zero(), handle_torque_W_ = models::Vec3::Zero();
  ToolState tool_;
  models::Wrench sensor_S_;
};

}  // namespace proxarm::sim
