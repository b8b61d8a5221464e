// The mechanics of the simulated arm, stepped in time: links, gears, rotors, friction, brakes, handle and hand.
//
// MuJoCo computes the links from the URDF that the controller also uses. The rotors are scalar equations beside
// MuJoCo's model. (This is Spong's reduced model of elastic joints: it includes a rotor's spin about its axis, but not
// its gyroscopic torque.) With φ the link's angle and θ the motor's angle divided by the gear ratio:
//   M(φ) φ̈ + c(φ, φ̇) + g(φ) = τ_gear + Jᵀ F_hand                                                 (a)
//   J_r θ̈ = τ − τ_gear − b θ̇ − τ_friction,   |τ_friction| ≤ F_c                                   (b)
//   τ_gear = k δ + d δ̇,   δ = θ − φ                                                               (c)
// With backlash, δ in (c) is reduced by the dead band, and τ_gear never pulls on the flank that is in contact. With
// ripple, τ is the drive's torque plus A sin(n N θ); A and n are the cell's values, N is the gear ratio. A gear with
// hysteresis has a friction z in parallel to its spring (Dahl, "A solid friction model", 1968):
//   τ_gear = k δ + d δ̇ + z,   dz/dδ = (k/2) (1 − sgn(δ̇) z/z_m),   z_m = k w/2                      (d)
// At τ_gear = 0 and after large swings, the loop of τ_gear over δ has the width w, which is the cell's hysteresis. z is
// exact if δ is monotonic within a step.
//
// A rotor is coupled only to its gear. Therefore Coulomb friction has an exact solution per axis: a stuck, braked or
// jammed rotor keeps its angle to the bit. (With a friction constraint in MuJoCo, the rotor would creep.)
//
// The step is symplectic Euler with implicit friction of the rotor. It is of first order in time, but it conserves the
// energy of free oscillation on average. The relative error of a mode's frequency ω is only (ωh)²/24: 0.3 ppm at 16 Hz
// and h = 0.25 ms.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "models/description/cell.hpp"
#include "models/geometry/geometry.hpp"

namespace proxarm::sim {

// True motion of the handle's rendered point T.
struct ToolState {
  models::Pose X_WT = models::Pose::Identity();
  models::Vec3 velocity_W = models::Vec3::Zero();              // velocity of T's origin, m/s
  models::Vec3 acceleration_W = models::Vec3::Zero();          // acceleration of T's origin, m/s²
  models::Vec3 angular_velocity_W = models::Vec3::Zero();      // rad/s
  models::Vec3 angular_acceleration_W = models::Vec3::Zero();  // rad/s²
};

struct Energy {
  double kinetic_J = 0.0;    // energy of links, rotors, handle and hand
  double potential_J = 0.0;  // energy of links and handle in the field of gravity
  double elastic_J = 0.0;    // energy in the gears
};

// The arm of a cell, its handle, and the mass of the hand that holds it. The hand is rigidly fixed to the handle at T
// and has the same inertia about each axis. The person carries the hand's weight, so gravity doesn't act on the hand.
//
// A step consists of advance() and then apply(). advance() goes to t + h with the accelerations that the last apply()
// computed. apply() sets the torques and forces that act from now on, and computes the accelerations and the sensor's
// wrench. All functions except the constructor, reset() and those that say so are noexcept and allocate nothing.
class ArmDynamics {
 public:
  // Throws description::SetupError if the URDF is unreadable, invalid or has <mimic>, if a joint or link is missing, or
  // if a joint has no drive.
  ArmDynamics(const description::Cell& cell, double hand_mass_kg, double step_s = 0.25e-3,
              double hand_inertia_kg_m2 = 0.0);
  ArmDynamics(const ArmDynamics&) = delete;
  ArmDynamics& operator=(const ArmDynamics&) = delete;
  ~ArmDynamics();

  // Puts the arm at rest. The links have these angles (one per drive, in the cell's order), gravity has wound up the
  // gears, the motors carry gravity (static_torque_Nm), and the brakes are closed.
  void reset(std::span<const double> joint_rad);

  void advance() noexcept;
  // `motor_torque_Nm` holds the motors' torques at the joints. `hand_force_W` and `hand_torque_W` are those of the
  // hand's muscles; they act on hand and handle at T. `arm_force_W` acts at the same point, but on the arm before the
  // sensor, so the sensor doesn't measure it.
  void apply(std::span<const double> motor_torque_Nm, const models::Vec3& hand_force_W,
             const models::Vec3& arm_force_W = models::Vec3::Zero(),
             const models::Vec3& hand_torque_W = models::Vec3::Zero()) noexcept;

  // jam() stops the rotor at once, with unlimited torque; the gear stays elastic. brake() does the same, unless the
  // cell gives the brake's torque: the brake is then dry friction of that torque, and a turning rotor slows down.
  void brake(std::size_t axis, bool closed) noexcept { axes_[axis].braked = closed; }
  void jam(std::size_t axis, bool jammed) noexcept { axes_[axis].jammed = jammed; }
  [[nodiscard]] bool braked(std::size_t axis) const noexcept { return axes_[axis].braked; }

  [[nodiscard]] std::size_t axis_count() const noexcept { return axes_.size(); }
  [[nodiscard]] double step_s() const noexcept { return step_s_; }
  [[nodiscard]] double motor_angle_rad(std::size_t axis) const noexcept { return axes_[axis].angle_rad; }
  [[nodiscard]] double motor_speed_rad_per_s(std::size_t axis) const noexcept { return axes_[axis].speed_rad_per_s; }
  [[nodiscard]] double joint_angle_rad(std::size_t axis) const noexcept;  // angle of the link behind the gear
  [[nodiscard]] double joint_speed_rad_per_s(std::size_t axis) const noexcept;
  [[nodiscard]] double gear_torque_Nm(std::size_t axis) const noexcept { return axes_[axis].gear_torque_Nm; }
  // Returns the motor torque that holds the links against gravity in their current pose.
  [[nodiscard]] double static_torque_Nm(std::size_t axis) const noexcept;

  [[nodiscard]] const ToolState& tool() const noexcept { return tool_; }
  // Returns the reading of an ideal sensor between flange and handle: the load of handle and hand on the sensor, about
  // the origin of S. At rest, the load is the handle's weight. A push along +x of S reads +x.
  [[nodiscard]] const models::Wrench& sensor_wrench_S() const noexcept { return sensor_S_; }
  // Returns the force that the hand exerts on the handle at T, without the part that accelerates the hand, in W.
  [[nodiscard]] models::Vec3 handle_force_W() const noexcept { return handle_force_W_; }
  // Returns the torque that the hand exerts on the handle about T, without the part that accelerates the hand, in W.
  [[nodiscard]] models::Vec3 handle_torque_W() const noexcept { return handle_torque_W_; }

  // The functions below are for tests and for printed properties. They may allocate.
  [[nodiscard]] Energy energy() const;
  // Returns (J M⁻¹ Jᵀ)⁻¹ at T with the rotors and without the hand, in W: the mass that a hand moves when nothing
  // controls the arm.
  [[nodiscard]] models::Mat3 effective_mass_kg() const;
  // Returns the undamped natural frequencies of the arm with locked motors, handle and hand included, in ascending
  // order.
  [[nodiscard]] std::vector<double> locked_modes_Hz() const;

  // Returns the ratio of the step to the limit of stability for links and rotors on their gears; below 1 the step is
  // stable. Derivation:
  // 1. Symplectic Euler is v(t+h) = v − h M⁻¹ (K q + C v), q(t+h) = q + h v(t+h).
  // 2. Its characteristic polynomial is M z² − (2M − hC − h²K) z + (M − hC).
  // 3. With symmetric K, C ≥ 0, a root leaves the unit circle at z = −1, where the polynomial is 4M − 2hC − h²K.
  // 4. So the step is stable while the largest eigenvalue of M⁻¹ (h²K + 2hC) is below 4.
  // The function returns this eigenvalue, divided by 4.
  [[nodiscard]] double step_share() const;

 private:
  struct Axis {
    // Index of the link's degree of freedom in MuJoCo's model. It is also the index in qpos, because each joint has one
    // degree of freedom.
    int dof = 0;
    double rotor_inertia_kg_m2 = 0.0, coulomb_Nm = 0.0, viscous_Nms_per_rad = 0.0;
    double stiffness_Nm_per_rad = 0.0, damping_Nms_per_rad = 0.0, half_backlash_rad = 0.0;
    double hysteresis_rad = 0.0;                    // w of (d)
    double ripple_Nm = 0.0, ripple_per_rad = 0.0;   // A and n N in the header's equation for τ
    double brake_Nm = 0.0;                          // 0: unlimited torque
    double angle_rad = 0.0, speed_rad_per_s = 0.0;  // angle and speed of the motor, divided by the gear ratio
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
  models::Mat3 handle_inertia_S_ = models::Mat3::Zero();  // about the handle's centre of mass
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
