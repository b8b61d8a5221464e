// Stability of the loop of stability.hpp with an elastic arm: its links oscillate on their gears, together with the
// hand.
//
// Light proxies oscillate because the hand's mass sits on gears of 8 to 20 Hz: its inertia pushes the sensor in phase
// with the gears' mode, the proxy yields to that force, and the motors drive the mode. This model is linearised about a
// pose; φ are the links' angles, θ the motors', and x = J φ is the tool's position:
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
// G = ∂(joint angles)/∂(tool position) with orientation held. M includes handle and tool. The matrix exponential
// integrates the continuous part exactly over a period. The result is one linear map from period to period, some 45
// rows for six joints; its largest eigenvalue decides on stability.
//
// A drive's loops aren't known, so usual ratios are assumed: ω_v is twice the bandwidth of its position loop, ω_p =
// ω_v/4, ω_i = ω_v/10. The integral part acts against the mode's damping; with light rotors a mode loses a third of its
// damping (collaborative arm of models/cells: smallest stable mass 3.9 kg, without the integral part 2.7 kg). The
// drives' yielding is left out where it is below a fiftieth of the gears' (default cell: 0.4 %).
//
// A lag lowers the gain of fast modes, to 0.78 at 80 Hz with a bandwidth of 100 Hz; feed-forward raises it, to 1.15 at
// 80 Hz and 1 ms. f is the setpoints' speed, on a straight line from the last segment's speed to the present one's. On
// average it is half a period behind r, so position and speed disagree, and θ overshoots. With feed-forward the
// integral part is left out, which changes θ by 1 %.
//
// k is the true gear stiffness, k⁻¹ the controller's value; they may differ (gear_stiffness_ratio).
//
// Not modelled: friction in the gears (it helps), backlash, limits, other poses.
//
// For set-up: some milliseconds per mass; allocates; not for the cycle.
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
  Eigen::MatrixXd axes{};  // of the tool's space in W, one column per dimension; empty: the space has angles
  // J_r of each rotor, at the joint, and ω_v of its drive; empty: the drives don't yield.
  Eigen::VectorXd rotor_kg_m2{}, drive_rad_per_s{};
  double torque_delay_s = 0.0;  // age of a reading of the gears' torque
};

// Gears without a stiffness are rigid. If the cell gives no gear damping, gears have 0.03 of the critical damping in
// the arm's first mode. This is low, because unmodelled effects must not make a loop seem stable.
ElasticArm elastic_arm(const models::Arm& arm, const models::JointVector& pose_rad, const description::Cell& cell);

// The same for the tool's rotation with its position held. J and G relate angles, so M, m_h, K_h and D_h are in kg m²,
// Nm/rad and Nms/rad. The hand's mass at T moves with the links. Precondition: six axes or more.
ElasticArm elastic_turning_arm(const models::Arm& arm, const models::JointVector& pose_rad,
                               const description::Cell& cell, double hand_mass_kg);

// The same for position and rotation together: three rows of J and columns of G for the position, then three for
// angles.
ElasticArm elastic_pose_arm(const models::Arm& arm, const models::JointVector& pose_rad, const description::Cell& cell);

// Where a hand leads the tool, relative to the start: an offset along W's axes, and a rotation vector in W.
struct Lead {
  models::Vec3 offset_m = models::Vec3::Zero(), turn_rad = models::Vec3::Zero();
};

// Whether two poses of the tool count as one: nearer than 50 mm and 0.1 rad. Modes change with the pose: over 0.3 m,
// the default cell's smallest stable mass changes by a third.
bool are_near(const models::ToolPose& a, const models::ToolPose& b) noexcept;

// Returns the links' angles at the start and at each lead in turn, as far as the arm reaches. Poses near to an earlier
// one are left out, and so are those after the sixteenth.
std::vector<models::JointVector> led_poses(const models::Arm& arm, const std::vector<Lead>& leads);

// How the tool is held, as matrices of its space: K_h, D_h and m_h of the hand, m_t of the handle.
struct Grip {
  Eigen::MatrixXd stiffness, damping, hand_mass, handle_mass;
};

// M, B and K_v of the proxy, as matrices of the tool's space.
struct ProxyMatrices {
  Eigen::MatrixXd mass, damping, spring;
};

class ElasticLoop {
 public:
  // `loop.delay_s` includes the filter's 2/ω and the period in which a setpoint is reached.
  ElasticLoop(const ElasticArm& arm, const HandModel& hand, const LoopModel& loop);
  // Returns the largest |z|; the loop is stable below 1. proxy_mass_kg > 0.
  [[nodiscard]] double spectral_radius(double proxy_mass_kg) const;

  ElasticLoop(const ElasticArm& arm, const Grip& grip, const LoopModel& loop);
  // The same for a proxy that can't move along the columns N of `forbidden`: Nᵀ q = 0.
  [[nodiscard]] double spectral_radius(const ProxyMatrices& proxy, const Eigen::MatrixXd& forbidden) const;
  // All eigenvalues z; the largest |z| is the spectral radius.
  [[nodiscard]] Eigen::VectorXcd eigenvalues(const ProxyMatrices& proxy, const Eigen::MatrixXd& forbidden) const;

 private:
  struct State;
  // The proxy's next position, linear in the force and in its last positions.
  struct Step {
    Eigen::MatrixXd of_force;
    std::vector<Eigen::MatrixXd> of_proxies;
  };
  [[nodiscard]] Step step_of(const ProxyMatrices& proxy, const Eigen::MatrixXd& N) const;
  [[nodiscard]] Eigen::Index size() const noexcept;        // of the state at a period's beginning,
  [[nodiscard]] Eigen::Index plant_size() const noexcept;  // and of the state that is integrated over the period
  // The linear map from period to period.
  [[nodiscard]] Eigen::MatrixXd map(const ProxyMatrices& proxy, const Eigen::MatrixXd& forbidden) const;
  void advance(const Eigen::VectorXd& state, const Step& step, Eigen::VectorXd& next) const;
  void make_plant(const Grip& grip, double gear_stiffness_ratio);
  [[nodiscard]] Eigen::Index kept_torques() const noexcept;  // number of old torques,
  [[nodiscard]] Eigen::Index kept_models() const noexcept;   // and of old accelerations in the model of torques
  using Place = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, 6, 1>;  // in the tool's space
  void damp(const Eigen::VectorXd& state, const Eigen::VectorXd& torque_now, const Eigen::VectorXd& carried,
            const Place& acceleration, Eigen::VectorXd& next) const;

  ElasticArm arm_;
  [[nodiscard]] bool damps() const noexcept { return of_damped_.rows() > 0; }

  double period_s_, damping_, spring_, horizon_s_, time_constant_s_;
  bool feeds_forward_;
  double force_age_periods_;
  int order_;
  Eigen::MatrixXd plant_;  // maps [φ, φ̇, θ, r, ṙ, δ, δ̇, ∫δ, θ̇, f, ḟ] over a period
  Eigen::MatrixXd force_;  // h from these states
  Eigen::MatrixXd twist_;  // k⁻¹ M G
  Eigen::MatrixXd gear_;   // the gears' torques from these states
  // Counts: joints n, tool dimensions, kept forces, kept proxies, states of yielding drives (3 n or 0), states of
  // feed-forward drives (2 n or 0).
  Eigen::Index joints_, dimensions_, ages_, proxies_, drives_, forward_;
  // Torque-damped gears: one row of the identity for each, and one column of κ/k; empty: no gear is damped.
  Eigen::MatrixXd of_damped_, yields_;
  double torque_ratio_, torque_age_periods_, torque_lag_periods_;  // of torque-damped gears
};

}  // namespace proxarm::controller
