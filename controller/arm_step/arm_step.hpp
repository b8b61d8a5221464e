// One step of the arm: finds the joints' step u that brings the tool nearest to a wanted pose, within all limits of
// joints and tool.
//
//   minimise |x(u) − x_d|², and then |R(u) ⊟ R_d|²,   where u ∈ U
// x, R: the tool's pose by exact kinematics at c(k−1) + u; c: the link angles before the setpoint filter. The sets of
// U:
//   box      low ≤ u ≤ high: each joint's range with room to brake, speed, and acceleration behind the filter. The
//            filter's input may therefore jump, as it does at a wall. But near a wrist singularity, during a turning
//            lag and while a hand turns the tool, steps also keep half of the acceleration before the filter, unless
//            the place needs more. With a held orientation, joints that only turn the tool always do: their motors lead
//            the links that they accelerate and can't follow jumps at a wrist.
//   place    −∇σ·u ≤ b: distance from singular poses (place_margin.hpp)
//   points   |p(u) − p(0)| ≤ vT for elbow and wrist, also while all joints brake from there (growth_m_per_s())
//   turn     the sets of turning (turn_sets.hpp); for a held orientation, its allowed lag
// Place and turn are borders, approached no faster than joints can brake. All sets but the box are curved; a half-space
// is added for each one that a solution has left.
//
// Position has priority over orientation. Near a wrist singularity, joints that can't turn the tool fast enough turn it
// later; the sets of turning bound that lag. But the tool isn't tilted to reach further: if the joints that carry the
// wrist can't go on, the position gives way. So the followable places (FollowableStep) are those to which these joints
// can carry the wrist with the tool in its wanted orientation, or, if it turns freely, in that of braking. The proxy's
// next place is one of them: the arm is sent to q(k).
//
// Each half-space is widened to what the joints can still do, so each single one leaves U nonempty. If several exclude
// each other, all joints brake together as hard as they can. A force in U's normal cone has f·(u − u_b) ≤ 0 for any
// step u_b of U: a limit never moves the arm further than braking would, so the arm can return from beyond a limit.
//
// If no set is active, the step is that of the inverse kinematics, to the bit. No allocation, lock or throw after
// construction.
#pragma once

#include <array>
#include <vector>

#include "controller/arm_step/place_margin.hpp"
#include "controller/limits/followable_step.hpp"
#include "controller/limits/step_limits.hpp"
#include "controller/proxies/turn_sets.hpp"
#include "models/arm/arm.hpp"
#include "models/arm/inverse_kinematics.hpp"
#include "models/base/state_archive.hpp"
#include "models/description/cell.hpp"
#include "models/geometry/nearest_in_polyhedron.hpp"

namespace proxarm::controller {

// Inputs of a step beside the arm's own history. Link angles in rad; filter as in elastic_setpoint.hpp.
struct ArmStepStart {
  models::JointVector coasting_rad;                          // filter input for which the output keeps its speed
  double input_s2 = 0.0;                                     // distance from it of another input, per rad/s²
  models::JointVector twist_rad;                             // lead of each motor over its link
  double tool_m_per_s = 0.5, elbow_m_per_s = 0.5;            // speed limits of T, and of elbow and wrist
  Eigen::Quaterniond R_WT = Eigen::Quaterniond::Identity();  // the wanted orientation
  bool held = true;                                          // R_WT stays the same, and a lag is caught up slowly
  bool touches_turning = false;                              // contacts of a shaped tool may change its turning at once
  TurnSets turn{};
};

class ArmStep final : public FollowableStep {
 public:
  // Precondition: arm and inverse kinematics outlive this object.
  ArmStep(const models::Arm& arm, const models::InverseKinematics& inverse,
          const std::vector<description::DriveDescription>& drives, double period_s);

  // Time in which all joints brake together from any speed; borders of curved sets are approached with it.
  [[nodiscard]] static double braking_s(const std::vector<description::DriveDescription>& drives) noexcept;

  void set_period(double period_s) noexcept;
  // Starts at rest at these link angles.
  void start(const models::JointVector& link_rad) noexcept;
  // The drives couldn't follow: continues from here with this step.
  void resume(const models::JointVector& link_rad, const models::JointVector& step_rad) noexcept;

  // Makes the sets of the next step.
  void begin(const ArmStepStart& start) noexcept;
  [[nodiscard]] bool contains(const models::Vec3& q_W) noexcept override;
  [[nodiscard]] bool cut(const models::Vec3& q_W, const models::Vec3& q_k1_W, LimitPlane<3>& out) noexcept override;

  enum class Outcome : std::uint8_t {
    reached,  // place and orientation
    lags,     // the place; the tool turns later
    held,     // the nearest place that can be followed
    invalid,  // the pose isn't finite; nothing has changed
  };
  // Moves towards this pose. Precondition: begin() was called for this step.
  Outcome go(const models::Vec3& q_W, const Eigen::Quaterniond& R_WT) noexcept;

  [[nodiscard]] const models::JointVector& link_rad() const noexcept { return link_rad_; }
  [[nodiscard]] const models::JointVector& step_rad() const noexcept { return step_rad_; }
  // The tool at link_rad().
  [[nodiscard]] const models::ToolKinematics& kinematics() const noexcept { return solution_.kinematics; }
  [[nodiscard]] Eigen::Quaterniond R_WT() const noexcept;
  // Limits that held the last step.
  [[nodiscard]] const ActiveLimits& active() const noexcept { return active_; }
  [[nodiscard]] std::uint64_t programs() const noexcept { return programs_; }  // quadratic programs solved so far
  [[nodiscard]] int iterations() const noexcept { return solution_.iterations; }
  void archive(fieldbus::StateArchive& state) noexcept;

 private:
  struct Joint {
    double lower_rad, upper_rad, speed_rad_per_s, acceleration_rad_per_s2;
    double per_step_rad, share;  // per period: maximum step; share of the way to the range's end
  };
  // Half-space a·u ≤ b, added because a solution left a curved set.
  struct Row {
    models::JointVector a;
    double b;
    Limit limit;
  };
  // The tool around the step u, linearised: x(u') ≈ x + J_p (u' − u), and the same for the rotation.
  struct Model {
    models::JointVector u;
    models::ToolKinematics at;
  };

  struct Box {
    models::JointVector low, high;
    [[nodiscard]] bool contains(const models::JointVector& u) const noexcept;
  };

  void make_boxes(const ArmStepStart& start) noexcept;
  [[nodiscard]] models::JointVector hardest_braking() const noexcept;
  [[nodiscard]] double least(const models::JointVector& a) const noexcept;
  [[nodiscard]] double room_rad(std::size_t i, double sign) const noexcept;
  [[nodiscard]] double place_bound(const PlaceMargin::Border& border) const noexcept;
  [[nodiscard]] bool allows(const models::JointVector& u) const noexcept;
  void use_box(double ease) noexcept;
  void use_first_box() noexcept;
  [[nodiscard]] bool eases() const noexcept;
  void turn_gently() noexcept;
  [[nodiscard]] bool near_wrist_singularity() const noexcept;
  [[nodiscard]] double growth_m_per_s(const models::JointVector& u) const noexcept;
  [[nodiscard]] models::JointVector growth_gradient(const models::JointVector& u) const noexcept;
  [[nodiscard]] double braking_of(Eigen::Index i, const models::JointVector& rad_per_s) const noexcept;
  [[nodiscard]] Eigen::Index slowest_to_brake(const models::JointVector& rad_per_s) const noexcept;
  [[nodiscard]] bool points_too_fast(const models::JointVector& u, const models::ToolKinematics* known) const noexcept;
  bool limit_points(const Model& model, const models::JointVector& u) noexcept;
  void linearise(const models::JointVector& u, Model& model) const noexcept;
  void start_model() noexcept;
  [[nodiscard]] models::Vec3 turn_from(const Model& model, const Eigen::Quaterniond& R) const noexcept;
  void objective(const Model& model, models::JointMatrix& H, models::JointVector& g) const noexcept;
  void add_sets() noexcept;
  void add_set(const models::JointVector& a, double b, Limit limit) noexcept;
  bool add_row(const models::JointVector& a, double b, Limit limit, const models::JointVector& step) noexcept;
  [[nodiscard]] std::size_t slackest_row(const models::JointVector& step) const noexcept;
  using Rows = PlaceMargin::Columns;
  bool can_carry_wrist(const models::Vec3& wanted) noexcept;
  bool solve_at(const Model& model, const Rows& J, const models::Vec3& wanted) noexcept;
  bool solve_near(const Model& model, const Rows& J, const models::Vec3& wanted) noexcept;
  [[nodiscard]] models::Vec3 turned_beyond(const Model& model, const models::JointVector& u) const noexcept;
  bool leave_curved_sets(const Model& model, const models::JointVector& u) noexcept;
  [[nodiscard]] models::JointVector taken_back(const Model& model, const models::JointVector& u) const noexcept;
  [[nodiscard]] ActiveLimits pressing() const noexcept;
  void note_joint(std::size_t i, double sign, ActiveLimits& out) const noexcept;
  void aim(const Eigen::Quaterniond& R_WT) noexcept;
  Outcome go_limited(const models::Vec3& x_W) noexcept;
  void accept(const models::JointVector& link_rad) noexcept;

  const models::Arm* arm_;
  const models::InverseKinematics* inverse_;
  std::vector<Joint> joints_;
  models::JointMatrix curvature_;
  models::JointVector cost_;  // of a joint's step, beside turning
  PlaceMargin margin_;
  double period_s_ = 0.0;
  double brakes_s_;  // braking_s()

  // History.
  models::JointVector link_rad_, step_rad_;
  bool lags_ = false;
  double catching_rad_per_s_ = 0.0;  // speed at which a held orientation catches up

  // This step.
  ArmStepStart start_;
  models::JointVector brakes_;   // all joints brake together, at half of their acceleration
  Box whole_, box_;              // U's box, and the part in use
  bool eases_ = false;           // a small part is tried first: eases()
  double ease_ = 0.0;            // of that part: allowed change of a joint's step, in halves of its acceleration
  models::ToolKinematics from_;  // at c(k−1)
  models::InverseKinematicsResult solution_;  // of the last queried pose; after the step, of its end
  models::Vec3 asked_W_ = models::Vec3::Zero();
  Eigen::Quaterniond aim_ = Eigen::Quaterniond::Identity();  // orientation of this step: R_WT, or part of the way there
  bool asked_ = false, allowed_ = false, catches_up_ = false, linearised_ = false;
  Model model_;
  PlaceMargin::Wrist wrist_;                            // by the model
  models::Vec3 wrist_wanted_W_ = models::Vec3::Zero();  // from T, with the tool in its wanted orientation
  std::array<Row, 16> rows_;
  std::size_t row_count_ = 0;
  models::NearestInPolyhedron program_;
  std::size_t first_set_ = 0, box_rows_ = 0;                     // first row of U in the program; rows of the box
  std::array<Limit, models::NearestInPolyhedron::most> kind_{};  // of the rows after the box
  ActiveLimits active_;
  std::uint64_t programs_ = 0;
};

}  // namespace proxarm::controller
