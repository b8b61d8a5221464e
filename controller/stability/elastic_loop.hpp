// Stability of the loop of stability.hpp with an elastic arm, whose links oscillate on their gears together with the
// hand.
//
// Light proxies oscillate because the hand's mass sits on gears whose modes are at 8 to 20 Hz. The inertia of the
// hand's mass pushes the sensor in phase with a mode, the proxy yields to that force, and the motors then drive the
// mode.
//
// The model is linearised about a pose. φ are the links' angles, θ the motors' angles, r the setpoints, and x = J φ is
// the tool's position:
//   links     (M + m_h JᵀJ) φ̈ = k(θ − φ) + d(θ̇ − φ̇) − Jᵀ(K_h J φ + D_h J φ̇)          in continuous time
//   motors    θ̇ = (r − θ)/τ, with r on a straight line from one setpoint to the next, a period later (τ = 0: θ = r);
//             with feed-forward instead  θ̈ = ω_v (ω_p (r − θ) + f − θ̇) + ḟ
//   drives    the gear's torque displaces the motor to θ + δ:
//             J_r (δ̈ + ω_v δ̇ + ω_v(ω_p + ω_i) δ + ω_v ω_i ω_p ∫δ) = −(gear's torque on the link)
//   sensor    h = −K_h x − D_h ẋ − (m_h + m_t) ẍ                                        m_t, m_h: handle and hand
//   proxy     A(w) q = w^(age/T) h                                                     as in stability.hpp
//   sent to   p = q + (H/T)(q − q₁)                                                    with lookahead
//   filter    x_f of p, critically damped; θ_sent = G x_f + k⁻¹ M G ẍ_f                 (elastic_setpoint.hpp)
//   damping   θ_sent −= (κ/k) y, y = s/(s + a)² (τ − M G ẍ_f)          where the gears' torque τ is measured
//   (gear_damping.hpp)
// G = ∂(joint angles)/∂(tool position) with the orientation held. M includes handle and tool. The matrix exponential
// integrates the continuous part exactly over a period. The result is one linear map from period to period, with some
// 45 rows for six joints. Its largest eigenvalue decides on stability.
//
// The drives' loops aren't known, so usual ratios are assumed: ω_v is twice the bandwidth of the drive's position loop,
// ω_p = ω_v/4, ω_i = ω_v/10. The drive's integral part acts against the damping of a mode: with light rotors, a mode
// loses a third of its damping. (The smallest stable mass of the collaborative arm in models/cells is 3.9 kg, and would
// be 2.7 kg without the integral part.) δ is left out if it is below a fiftieth of the gears' twist; on the default
// cell it is 0.4 %.
//
// A lag lowers the gain of fast modes, to 0.78 at 80 Hz with a bandwidth of 100 Hz. Feed-forward raises the gain, to
// 1.15 at 80 Hz with T = 1 ms. f is the setpoints' speed; within a period it goes in a straight line from the speed of
// the last period to the speed of the present period. On average f is half a period behind r, so position and speed
// disagree, and θ overshoots. With feed-forward, the drive's integral part is left out, which changes θ by 1 %.
//
// In these equations, k is the true gear stiffness, but k⁻¹ is the inverse of the controller's value. The two values
// may differ (gear_stiffness_ratio).
//
// Not modelled: friction in the gears (which helps), backlash, limits, poses other than the given one.
//
// For set-up, not for the cycle: takes some milliseconds per mass; allocates.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "models/arm/arm.hpp"
#include "models/description/cell.hpp"
#include "models/geometry/tool_pose.hpp"

namespace proxarm::controller {

struct HandModel;
struct LoopModel;

// The controller's elastic model of an arm in one pose, with joints in the order of the drives.
struct ElasticArm {
  Eigen::MatrixXd mass;                // M of the links and the tool, joint by joint
  Eigen::MatrixXd jacobian;            // J of the tool's position: one row for each dimension of its space
  Eigen::MatrixXd joints_per_m;        // G: one column for each of these dimensions
  Eigen::VectorXd stiffness, damping;  // k > 0 and d ≥ 0 of each gear
  double filter_s = 0.0;               // 1/ω of the setpoints' filter; 0: none
  // The axes of the tool's space in W, one column per dimension. Empty: the space includes rotations.
  Eigen::MatrixXd axes{};
  // J_r of each rotor, at the joint, and ω_v of the rotor's drive. Empty: the drives don't yield to the gears' torque.
  Eigen::VectorXd rotor_kg_m2{}, drive_rad_per_s{};
  double torque_delay_s = 0.0;  // age of a reading of the gears' torque
};

// Returns the model in this pose. A gear without a stiffness in the cell is rigid. A gear without a damping in the cell
// has 0.03 of the critical damping in the arm's first mode. This is low, because unmodelled effects must not make a
// loop seem stable.
ElasticArm elastic_arm(const models::Arm& arm, const models::JointVector& pose_rad, const description::Cell& cell);

// Returns the model for the tool's rotation, with the tool's position held. J and G then refer to angles of the tool,
// so m_h, K_h and D_h are in kg m², Nm/rad and Nms/rad, like the proxy's mass, damping and spring. M includes the
// hand's mass at T, which moves with the links. Precondition: six axes or more.
ElasticArm elastic_turning_arm(const models::Arm& arm, const models::JointVector& pose_rad,
                               const description::Cell& cell, double hand_mass_kg);

// Returns the model for position and rotation together. J has three rows for the position, then three rows for angles;
// G has columns in the same order.
ElasticArm elastic_pose_arm(const models::Arm& arm, const models::JointVector& pose_rad, const description::Cell& cell);

// The place to which a hand leads the tool, relative to the start: an offset along W's axes, and a rotation vector in
// W.
struct Lead {
  models::Vec3 offset_m = models::Vec3::Zero(), turn_rad = models::Vec3::Zero();
};

// Returns whether two poses of the tool count as one: they are nearer than 50 mm and 0.1 rad. The distance is this
// small because modes change with the pose: over 0.3 m, the default cell's smallest stable mass changes by a third.
bool are_near(const models::ToolPose& a, const models::ToolPose& b) noexcept;

// Returns the links' angles at the start and then at each lead, in the order of `leads`, as far as the arm reaches.
// Leaves out leads near to an earlier pose (are_near()), and everything after sixteen poses.
std::vector<models::JointVector> led_poses(const models::Arm& arm, const std::vector<Lead>& leads);

// How the hand holds the tool, as matrices of the tool's space: K_h, D_h and m_h of the hand, m_t of the handle.
struct Grip {
  Eigen::MatrixXd stiffness, damping, hand_mass, handle_mass;
};

// M, B and K_v of the proxy, as matrices of the tool's space.
struct ProxyMatrices {
  Eigen::MatrixXd mass, damping, spring;
};

class ElasticLoop {
 public:
  // `loop.delay_s` includes the filter's delay 2/ω, and the one period in which a drive reaches its setpoint.
  ElasticLoop(const ElasticArm& arm, const HandModel& hand, const LoopModel& loop);
  // Returns the largest |z| of all eigenvalues; the loop is stable below 1. Precondition: proxy_mass_kg > 0.
  [[nodiscard]] double spectral_radius(double proxy_mass_kg) const;

  ElasticLoop(const ElasticArm& arm, const Grip& grip, const LoopModel& loop);
  // Returns the largest |z| with a proxy that can't move along the columns N of `forbidden`: Nᵀ q = 0.
  [[nodiscard]] double spectral_radius(const ProxyMatrices& proxy, const Eigen::MatrixXd& forbidden) const;
  // Returns all eigenvalues z; spectral_radius() is the largest |z|.
  [[nodiscard]] Eigen::VectorXcd eigenvalues(const ProxyMatrices& proxy, const Eigen::MatrixXd& forbidden) const;

 private:
  struct State;
  // The proxy's next position as a linear function of the force and of the proxy's last positions.
  struct Step {
    Eigen::MatrixXd of_force;
    std::vector<Eigen::MatrixXd> of_proxies;
  };
  [[nodiscard]] Step step_of(const ProxyMatrices& proxy, const Eigen::MatrixXd& N) const;
  [[nodiscard]] Eigen::Index size() const noexcept;        // number of states at a period's beginning
  [[nodiscard]] Eigen::Index plant_size() const noexcept;  // number of states that are integrated over the period
  // Returns the linear map of the states at a period's beginning to those at the next period's beginning.
  [[nodiscard]] Eigen::MatrixXd map(const ProxyMatrices& proxy, const Eigen::MatrixXd& forbidden) const;
  void advance(const Eigen::VectorXd& state, const Step& step, Eigen::VectorXd& next) const;
  void make_plant(const Grip& grip, double gear_stiffness_ratio);
  [[nodiscard]] Eigen::Index kept_torques() const noexcept;  // number of kept old torques
  [[nodiscard]] Eigen::Index kept_models() const noexcept;   // number of kept old accelerations (torque model)
  using Place = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, 6, 1>;  // a vector in the tool's space
  void damp(const Eigen::VectorXd& state, const Eigen::VectorXd& torque_now, const Eigen::VectorXd& carried,
            const Place& acceleration, Eigen::VectorXd& next) const;

  ElasticArm arm_;
  [[nodiscard]] bool damps() const noexcept { return of_damped_.rows() > 0; }

  double period_s_, damping_, spring_, horizon_s_, time_constant_s_;
  bool feeds_forward_;
  double force_age_periods_;
  int order_;
  Eigen::MatrixXd plant_;  // maps [φ, φ̇, θ, r, ṙ, δ, δ̇, ∫δ, θ̇, f, ḟ] over a period
  Eigen::MatrixXd force_;  // maps these states to h
  Eigen::MatrixXd twist_;  // k⁻¹ M G
  Eigen::MatrixXd gear_;   // maps these states to the gears' torques
  // Numbers of: joints n; dimensions of the tool's space; kept forces; kept positions of the proxy; states of yielding
  // drives (3 n or 0); states of feed-forward drives (2 n or 0).
  Eigen::Index joints_, dimensions_, ages_, proxies_, drives_, forward_;
  // For torque-damped gears. of_damped_ has a row of the identity for each such gear, yields_ has a column of κ/k for
  // each. Empty: no gear is damped.
  Eigen::MatrixXd of_damped_, yields_;
  double torque_ratio_, torque_age_periods_, torque_lag_periods_;  // errors and delays of torque-damped gears
};

}  // namespace proxarm::controller
