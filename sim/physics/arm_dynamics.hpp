// The mechanics of the simulated arm, stepped in time: links, gears, rotors, friction, brakes, handle and hand.
//
// MuJoCo computes the links from the URDF that the controller uses; the rotors are scalar equations beside it (Spong's
// reduced model of elastic joints: it includes a rotor's spin about its axis, but not its gyroscopic torque). With φ
// the link's angle and θ the motor's, as an angle at the joint:
//   M(φ) φ̈ + c(φ, φ̇) + g(φ) = τ_gear + Jᵀ F_hand                                                 (a)
//   J_r θ̈ = τ − τ_gear − b θ̇ − τ_friction,   |τ_friction| ≤ F_c                                   (b)
//   τ_gear = k δ + d δ̇,  δ = θ − φ; with backlash, δ less the dead band, and never against the flank in contact   (c)
// With ripple, τ is the drive's torque plus A sin(n N θ), with A and n of the cell and N the gear ratio. A gear with
// hysteresis has a friction z in parallel to its spring (Dahl, "A solid friction model", 1968). At τ_gear = 0 and after
// large swings, its loop has the width w, the cell's hysteresis:
//   τ_gear = k δ + d δ̇ + z,   dz/dδ = (k/2) (1 − sgn(δ̇) z/z_m),   z_m = k w/2                              (d)
// z is exact if δ is monotonic within a step. A rotor is coupled only to its gear, so Coulomb friction has an exact
// solution per axis: a stuck, braked or jammed rotor keeps its angle to the bit (a friction constraint in MuJoCo
// creeps).
//
// Step: symplectic Euler with the rotor's friction implicit. First order in time, but it conserves the energy of free
// oscillation on average, and the frequency of a mode ω is wrong by only (ωh)²/24: 0.3 ppm at 16 Hz and h = 0.25 ms.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "models/description/cell.hpp"
#include "models/geometry/geometry.hpp"

namespace proxarm::sim {

// True motion of the rendered point T of the handle.
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

// The arm of a cell, its handle, and the mass of the hand that holds it. The hand is rigidly fixed to the handle at T,
// with the same inertia about each axis. The person carries its weight, so gravity doesn't act on it.
//
// A step is advance(), then apply(). advance() goes to t + h with the accelerations of the last apply(); apply() sets
// the torques and the force that act from now on, and computes accelerations and the sensor's wrench. Everything but
// the constructor and reset() is noexcept and allocates nothing.
class ArmDynamics {
 public:
  // Throws description::SetupError: unreadable or invalid URDF, <mimic>, missing joint or link, joint without a drive.
  ArmDynamics(const description::Cell& cell, double hand_mass_kg, double step_s = 0.25e-3,
              double hand_inertia_kg_m2 = 0.0);
  ArmDynamics(const ArmDynamics&) = delete;
  ArmDynamics& operator=(const ArmDynamics&) = delete;
  ~ArmDynamics();

  // Puts the arm at rest with the links at these angles (one per drive, in the cell's order), the gears wound up by
  // gravity, the motors carrying it (static_torque_Nm) and the brakes closed.
  void reset(std::span<const double> joint_rad);

  void advance() noexcept;
  // `motor_torque_Nm`: at the joints. `hand_force_W`, `hand_torque_W`: of the hand's muscles, on hand and handle at T.
  // `arm_force_W` acts at the same point, but on the arm before the sensor, which doesn't measure it.
  void apply(std::span<const double> motor_torque_Nm, const models::Vec3& hand_force_W,
             const models::Vec3& arm_force_W = models::Vec3::Zero(),
             const models::Vec3& hand_torque_W = models::Vec3::Zero()) noexcept;

  // A jam stops the rotor at once, without a torque limit; the gear stays elastic. A closed brake does the same, unless
  // the cell gives its torque: then it is dry friction of that torque, and a turning rotor slows down.
  void brake(std::size_t axis, bool closed) noexcept { axes_[axis].braked = closed; }
  void jam(std::size_t axis, bool jammed) noexcept { axes_[axis].jammed = jammed; }
  [[nodiscard]] bool braked(std::size_t axis) const noexcept { return axes_[axis].braked; }

  [[nodiscard]] std::size_t axis_count() const noexcept { return axes_.size(); }
  [[nodiscard]] double step_s() const noexcept { return step_s_; }
  [[nodiscard]] double motor_angle_rad(std::size_t axis) const noexcept { return axes_[axis].angle_rad; }
  [[nodiscard]] double motor_speed_rad_per_s(std::size_t axis) const noexcept { return axes_[axis].speed_rad_per_s; }
  [[nodiscard]] double joint_angle_rad(std::size_t axis) const noexcept;  // on the link side of the gear
  [[nodiscard]] double joint_speed_rad_per_s(std::size_t axis) const noexcept;
  [[nodiscard]] double gear_torque_Nm(std::size_t axis) const noexcept { return axes_[axis].gear_torque_Nm; }
  // Motor torque that holds the links against gravity in their present pose.
  [[nodiscard]] double static_torque_Nm(std::size_t axis) const noexcept;

  [[nodiscard]] const ToolState& tool() const noexcept { return tool_; }
  // Reading of an ideal sensor between flange and handle: the load of handle and hand on it, about S's origin. At rest,
  // that is the handle's weight; a push along +x of S reads +x.
  [[nodiscard]] const models::Wrench& sensor_wrench_S() const noexcept { return sensor_S_; }
  // Force that the hand feels: hand on handle at T, without the hand's inertia, in W.
  [[nodiscard]] models::Vec3 handle_force_W() const noexcept { return handle_force_W_; }
  // The same for the torque about T.
  [[nodiscard]] models::Vec3 handle_torque_W() const noexcept { return handle_torque_W_; }

  // For tests and printed properties. May allocate.
  [[nodiscard]] Energy energy() const;
  // (J M⁻¹ Jᵀ)⁻¹ at T with rotors, without the hand: the mass that a hand moves when nothing controls the arm. In W.
  [[nodiscard]] models::Mat3 effective_mass_kg() const;
  // Undamped natural frequencies of the arm with locked motors, ascending; handle and hand included.
  [[nodiscard]] std::vector<double> locked_modes_Hz() const;

  // Ratio of the step to the limit of stability of links and rotors on their gears: stable below 1. Symplectic Euler,
  // v(t+h) = v − h M⁻¹ (K q + C v), q(t+h) = q + h v(t+h), has the polynomial M z² − (2M − hC − h²K) z + (M − hC). For
  // symmetric K, C ≥ 0 it leaves the unit circle at z = −1, where 4M − 2hC − h²K becomes singular: stable while the
  // largest eigenvalue of M⁻¹ (h²K + 2hC) is below 4. Returns that eigenvalue, divided by 4.
  [[nodiscard]] double step_share() const;

 private:
  struct Axis {
    int dof = 0;  // of the link in MuJoCo's model; joints have one degree of freedom, so also the index in qpos
    double rotor_inertia_kg_m2 = 0.0, coulomb_Nm = 0.0, viscous_Nms_per_rad = 0.0;
    double stiffness_Nm_per_rad = 0.0, damping_Nms_per_rad = 0.0, half_backlash_rad = 0.0;
    double hysteresis_rad = 0.0;                    // w of (d)
    double ripple_Nm = 0.0, ripple_per_rad = 0.0;   // A and n N
    double brake_Nm = 0.0;                          // 0: unlimited
    double angle_rad = 0.0, speed_rad_per_s = 0.0;  // of the motor, as an angle at the joint
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
