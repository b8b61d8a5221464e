// The loop of stability.hpp with an elastic arm: links that oscillate on their gears, together with the hand.
//
// The rigid loop neglects what makes light proxies oscillate: the hand's mass on gears of 8 to 20 Hz. Its inertia
// pushes the sensor in phase with the gears' mode, the proxy yields to that force, and the motors drive the mode. This
// model is linearised about a pose, with φ the links' angles, θ the motors', and x = J φ the tool's position:
//   links     (M + m_h JᵀJ) φ̈ = k(θ − φ) + d(θ̇ − φ̇) − Jᵀ(K_h J φ + D_h J φ̇)          in continuous time
//   motors    θ̇ = (r − θ)/τ, with r on a straight line from one setpoint to the next, a period later (τ = 0: θ = r);
//             with feed-forward instead  θ̈ = ω_v (ω_p (r − θ) + f − θ̇) + ḟ
//   drives    the motor is at θ + δ, for what the gear pulls it away:
//             J_r (δ̈ + ω_v δ̇ + ω_v(ω_p + ω_i) δ + ω_v ω_i ω_p ∫δ) = −(gear's torque on the link)
//   sensor    h = −K_h x − D_h ẋ − (m_h + m_t) ẍ                                        m_t, m_h: handle and hand
//   proxy     A(w) q = w^(age/T) h                                                     as in stability.hpp
//   sent to   p = q + (H/T)(q − q₁)                                                    with lookahead
//   filter    x_f of p, critically damped; θ_sent = G x_f + k⁻¹ M G ẍ_f                 (elastic_setpoint.hpp)
//   damping   θ_sent −= (κ/k) y, y = s/(s + a)² (τ − M G ẍ_f)          where the gears' torque τ is measured
//   (gear_damping.hpp)
// G = ∂(joint angles)/∂(tool position), orientation held. M includes handle and tool. Over a period the continuous part
// is integrated exactly, by its matrix exponential. Together this is one linear map from period to period, whose
// largest eigenvalue decides on stability. For six joints it is a matrix of some 45 rows.
//
// A drive's loops aren't known; ω_v is taken to be twice the bandwidth of its position loop, ω_p = ω_v/4, ω_i = ω_v/10,
// as is usual. Its integral part pushes behind the gear, against the mode's damping: where rotors are light, as in arms
// that weigh little, a mode loses a third of its damping to that (the collaborative arm of models/cells: 3.9 kg are the
// smallest that come to rest, and 2.7 were said to be). Left out where the drives yield less than a fiftieth of the
// gears (the default cell: 0.4 %).
//
// A drive's bandwidth doesn't say how it follows, either. A lag takes gain from fast modes, by 0.78 at 80 Hz with 100
// Hz; feed-forward gives some to them. f is the setpoints' speed, on a straight line from that of the last segment to
// that of this one: on the mean half a period behind r, so place and speed disagree, and θ goes too far: by 1.15 at 80
// Hz and 1 ms, with the loops above. (The simulated drives are of this kind: a hand that turns with 60 Nm/rad makes the
// default cell's wrist swing at 82 Hz, with an inertia that is a quarter above what is stable with drives that lag.)
// Their ∫ is left out of this, which changes θ by 1 % there.
//
// The gears' true stiffness may differ from the believed one, in k but not in k⁻¹ (gear_stiffness_ratio).
//
// Not modelled: friction in the gears, which helps; backlash; limits; other poses.
//
// For set-up: takes some milliseconds per mass, allocates, never runs in the cycle.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "models/arm/arm.hpp"
#include "models/description/cell.hpp"
#include "models/geometry/tool_pose.hpp"

namespace proxarm::controller {

struct HandModel;
struct LoopModel;

// An arm in a pose, with its joints in the order of the drives, as the controller models it.
struct ElasticArm {
  Eigen::MatrixXd mass;                // M of the links and the tool, joint by joint
  Eigen::MatrixXd jacobian;            // J of the tool's position: a row for each dimension of its space
  Eigen::MatrixXd joints_per_m;        // G: a column for each of these dimensions
  Eigen::VectorXd stiffness, damping;  // k > 0 and d ≥ 0 of each gear
  double filter_s = 0.0;               // 1/ω of the setpoints' filter; 0: none
  Eigen::MatrixXd axes{};  // of the tool's space in W, a column for each dimension; empty: not a space of places
  // J_r of each rotor, at the joint, and ω_v of its drive; empty: the drives don't yield.
  Eigen::VectorXd rotor_kg_m2{}, drive_rad_per_s{};
  double torque_delay_s = 0.0;  // how old a reading of the gears' torque is
};

// Gears without a stiffness are rigid. If a drive doesn't tell its gear's damping, gears have 0.03 of the critical
// damping in the arm's first mode. This is little, because unmodelled effects must not make a loop seem stable.
ElasticArm elastic_arm(const models::Arm& arm, const models::JointVector& pose_rad, const description::Cell& cell);

// The same for the tool's rotation, with its place held: J and G are of angles, so that M, m_h, K_h and D_h are read as
// kg m², Nm/rad and Nms/rad. The hand's mass at T moves with the links. Precondition: six axes or more.
ElasticArm elastic_turning_arm(const models::Arm& arm, const models::JointVector& pose_rad,
                               const description::Cell& cell, double hand_mass_kg);

// The same for place and rotation together: J and G have three rows and columns for the place, then three for angles.
ElasticArm elastic_pose_arm(const models::Arm& arm, const models::JointVector& pose_rad, const description::Cell& cell);

// How far from where it is at the start a hand leads the tool, along W's axes, and turns it, by a rotation vector in W.
struct Lead {
  models::Vec3 offset_m = models::Vec3::Zero(), turn_rad = models::Vec3::Zero();
};

// Modes change with the pose: over 0.3 m, the default cell's smallest stable mass changes by a third. Poses of the tool
// that are nearer than 50 mm and 0.1 rad are taken for one.
bool are_near(const models::ToolPose& a, const models::ToolPose& b) noexcept;

// The links' angles at the start, and where the tool is led to from there, one after the other, as far as the arm gets.
// What is near to another one is left out, and so is what comes after the sixteenth.
std::vector<models::JointVector> led_poses(const models::Arm& arm, const std::vector<Lead>& leads);

// Who holds the tool, in matrices of its space: K_h, D_h and m_h of the hand, m_t of the handle.
struct Grip {
  Eigen::MatrixXd stiffness, damping, hand_mass, handle_mass;
};

// M, B and K_v of the proxy, likewise.
struct ProxyMatrices {
  Eigen::MatrixXd mass, damping, spring;
};

class ElasticLoop {
 public:
  // `loop.delay_s` includes the filter's 2/ω and the period in which a setpoint is reached, as everywhere.
  ElasticLoop(const ElasticArm& arm, const HandModel& hand, const LoopModel& loop);
  // The largest |z|; the loop is stable below 1. M is the proxy's, > 0.
  [[nodiscard]] double spectral_radius(double proxy_mass_kg) const;

  ElasticLoop(const ElasticArm& arm, const Grip& grip, const LoopModel& loop);
  // The same of a proxy that can't move along the columns N of `forbidden`: Nᵀ q = 0.
  [[nodiscard]] double spectral_radius(const ProxyMatrices& proxy, const Eigen::MatrixXd& forbidden) const;
  // All z, of which the largest |z| is the spectral radius.
  [[nodiscard]] Eigen::VectorXcd eigenvalues(const ProxyMatrices& proxy, const Eigen::MatrixXd& forbidden) const;

 private:
  struct State;
  // What the proxy's next place is of the force and of its last places.
  struct Step {
    Eigen::MatrixXd of_force;
    std::vector<Eigen::MatrixXd> of_proxies;
  };
  [[nodiscard]] Step step_of(const ProxyMatrices& proxy, const Eigen::MatrixXd& N) const;
  [[nodiscard]] Eigen::Index size() const noexcept;        // of the state at a period's beginning,
  [[nodiscard]] Eigen::Index plant_size() const noexcept;  // and of what is integrated over the period
  // From period to period.
  [[nodiscard]] Eigen::MatrixXd map(const ProxyMatrices& proxy, const Eigen::MatrixXd& forbidden) const;
  void advance(const Eigen::VectorXd& state, const Step& step, Eigen::VectorXd& next) const;
  void make_plant(const Grip& grip, double gear_stiffness_ratio);
  [[nodiscard]] Eigen::Index kept_torques() const noexcept;  // old ones,
  [[nodiscard]] Eigen::Index kept_models() const noexcept;   // and accelerations that the model of torques had
  using Place = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, 6, 1>;  // in the tool's space
  void damp(const Eigen::VectorXd& state, const Eigen::VectorXd& torque_now, const Eigen::VectorXd& carried,
            const Place& acceleration, Eigen::VectorXd& next) const;

  ElasticArm arm_;
  [[nodiscard]] bool damps() const noexcept { return of_damped_.rows() > 0; }

  double period_s_, damping_, spring_, horizon_s_, time_constant_s_;
  bool feeds_forward_;
  double force_age_periods_;
  int order_;
  Eigen::MatrixXd plant_;  // the map of [φ, φ̇, θ, r, ṙ, δ, δ̇, ∫δ, θ̇, f, ḟ] over a period
  Eigen::MatrixXd force_;  // h from these
  Eigen::MatrixXd twist_;  // k⁻¹ M G
  Eigen::MatrixXd gear_;   // the gears' torques from these
  // Numbers of joints n, of tool dimensions, of old forces and proxies that are kept, and of the drives' states: those
  // that yield, 3 n or none, and those that feed forward, 2 n or none.
  Eigen::Index joints_, dimensions_, ages_, proxies_, drives_, forward_;
  // Of gears that are damped by their torque: a row of the identity for each, and a column of κ/k; empty: none is.
  Eigen::MatrixXd of_damped_, yields_;
  double torque_ratio_, torque_age_periods_, torque_lag_periods_;  // of gears that are damped by their torque
};

}  // namespace proxarm::controller
