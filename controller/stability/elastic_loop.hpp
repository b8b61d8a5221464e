// The loop of stability.hpp with the arm as it is: links that swing on their gears, and a hand that swings with them.
//
// What the rigid loop leaves out is what makes light proxies swing: a hand of some mass upon gears of 8 to 20 Hz. Its
// inertia pushes the sensor in time with the gears' mode, the proxy yields to that, and the motors feed the mode. So
// small deviations about a pose are taken, with φ the links' angles, θ the motors', x = J φ the tool's place:
//   links     (M + m_h JᵀJ) φ̈ = k(θ − φ) + d(θ̇ − φ̇) − Jᵀ(K_h J φ + D_h J φ̇)          in continuous time
//   motors    θ̇ = (r − θ)/τ, with r on a straight line from one setpoint to the next, a period later (τ = 0: θ = r)
//   sensor    h = −K_h x − D_h ẋ − (m_h + m_t) ẍ                                        m_t, m_h: handle and hand
//   proxy     A(w) q = w^(age/T) h                                                     as in stability.hpp
//   sent to   p = q + (H/T)(q − q₁)                                                    with lookahead
//   filter    x_f of p, critically damped; θ_sent = G x_f + k⁻¹ M G ẍ_f                 (elastic_setpoint.hpp)
// G = ∂(joint angles)/∂(tool place), orientation held. M has handle and tool in it. Over a period the continuous part
// is exact, by its matrix exponential; all of it together is one linear map from period to period, whose largest
// eigenvalue tells. For six joints that is a matrix of some 45 rows.
//
// What it doesn't know: friction in the gears, which helps; backlash; limits; poses other than its own.
//
// For set-up: takes some milliseconds a mass, allocates, never runs in the cycle.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "models/arm/arm.hpp"
#include "models/description/cell.hpp"

namespace proxarm::controller {

struct HandModel;
struct LoopModel;

// An arm in a pose, its joints in the order of the drives; what the controller takes it for.
struct ElasticArm {
  Eigen::MatrixXd mass;                // M of the links and the tool, joint by joint
  Eigen::MatrixXd jacobian;            // J, a row for each dimension of the tool's space: of its place
  Eigen::MatrixXd joints_per_m;        // G, a column for each of them
  Eigen::VectorXd stiffness, damping;  // k > 0 and d ≥ 0 of each gear
  double filter_s = 0.0;               // 1/ω of the setpoints' filter; 0: none
};

// Gears of no stiffness are rigid. Where a drive doesn't say its gear's damping, gears ring with 0.03 of the critical
// damping in the arm's first mode: little, since what is left out must not make a loop seem stable.
ElasticArm elastic_arm(const models::Arm& arm, const models::JointVector& pose_rad, const description::Cell& cell);

// At the start, and where the tool is led from there, one place after the other; as far as the arm gets. Modes change
// with the pose: the default cell's smallest stable mass by a third on 0.3 m. Places within 50 mm of another are left
// out, and so is what comes after the sixteenth.
std::vector<ElasticArm> elastic_arms(const models::Arm& arm, const description::Cell& cell,
                                     const std::vector<models::Vec3>& offsets_W);

class ElasticLoop {
 public:
  // `loop.delay_s` has the filter's 2/ω and the period that a setpoint needs to be reached, as everywhere.
  ElasticLoop(const ElasticArm& arm, const HandModel& hand, const LoopModel& loop);
  // The largest |z|; stable below 1. M is the proxy's, > 0.
  [[nodiscard]] double spectral_radius(double proxy_mass_kg) const;

 private:
  struct State;
  [[nodiscard]] Eigen::Index size() const noexcept;
  void advance(const Eigen::VectorXd& state, double proxy_mass_kg, Eigen::VectorXd& next) const;
  void make_plant(const HandModel& hand);

  ElasticArm arm_;
  double period_s_, damping_, spring_, horizon_s_, time_constant_s_;
  double force_age_periods_;
  int order_;
  bool matched_labels_;
  Eigen::MatrixXd plant_;                    // [φ, φ̇, θ, r, ṙ] over a period
  Eigen::MatrixXd force_;                    // h of [φ, φ̇, θ, r, ṙ]
  Eigen::MatrixXd twist_;                    // k⁻¹ M G
  Eigen::Index joints_, dimensions_, ages_;  // n, those of the tool's space, and how many old forces are kept
};

}  // namespace proxarm::controller
