// Finds one step of the arm: the joints' step u that brings the tool nearest to a wanted pose, within all limits of
// joints and tool.
//
//   minimise |x(u) − x_d|², and then |R(u) ⊟ R_d|²,   where u ∈ U
// c: the link angles before the setpoint filter. x, R: the tool's pose by exact kinematics at c(k−1) + u. x_d, R_d: the
// wanted pose. U is the intersection of these sets:
//   box      low ≤ u ≤ high. Bounds each joint's range with room to brake, its speed, and its acceleration behind the
//            filter. The filter's input may jump, as it does at a wall. In three cases a joint's acceleration before
//            the filter is also at most half of its maximum, unless the place needs more: near a wrist singularity,
//            during a turning lag, and while a hand turns the tool. With a held orientation, joints that only turn the
//            tool keep this bound even if the place needs more: motors lead the links that they accelerate, and the
//            motors of a wrist can't follow jumps.
//   place    −∇σ·u ≤ b. Keeps the arm away from singular poses (place_margin.hpp).
//   points   |p(u) − p(0)| ≤ vT for elbow and wrist, also while all joints brake after this step (growth_m_per_s()).
//   turn     The sets of turning (turn_sets.hpp); for a held orientation, its allowed lag.
// The arm approaches the borders of place and turn no faster than its joints can brake. All sets but the box are
// curved; for each curved set that a solution has left, a half-space is added.
//
// Position has priority over orientation. Near a wrist singularity, joints that can't turn the tool fast enough turn
// the tool later; the sets of turning bound this lag. But the tool isn't tilted to reach further: if the joints that
// carry the wrist can't move further, the position gives way. So the places that the arm can reach (FollowableStep) are
// the places to which these joints can carry the wrist, with the tool in its wanted orientation or, if the tool turns
// freely, in the orientation after braking. The proxy's next place is one of them, so the arm is sent to q(k).
//
// Each half-space is widened to what the joints can still do, so a single half-space never makes U empty. If several
// half-spaces exclude each other, all joints brake together as hard as they can. The force f of U's borders satisfies
// f·(u − u_b) ≤ 0 for every step u_b in U. So a limit never moves the arm further than braking would, and the arm can
// return from beyond a limit.
//
// If no set is active, the step equals the step of the inverse kinematics to the bit. Nothing allocates, locks or
// throws after construction.
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

// Inputs of a step beside the history in ArmStep. The filter is the setpoint filter (elastic_setpoint.hpp).
struct ArmStepStart {
  models::JointVector coasting_rad;  // filter input (link angles) for which the filter's output keeps its speed
  // Distance of another filter input from coasting_rad, divided by the mean acceleration that this input causes.
  double input_s2 = 0.0;
  models::JointVector twist_rad;  // lead of each motor over its link
  // Speed limits: tool_m_per_s of T, elbow_m_per_s of elbow and wrist.
  double tool_m_per_s = 0.5, elbow_m_per_s = 0.5;
  Eigen::Quaterniond R_WT = Eigen::Quaterniond::Identity();  // the wanted orientation
  bool held = true;              // the wanted orientation is constant, and a tool that lags turns to it slowly
  bool touches_turning = false;  // contacts of a tool with a shape may change its turning at once
  TurnSets turn{};
};

class ArmStep final : public FollowableStep {
 public:
  // Precondition: arm and inverse kinematics outlive this object.
  ArmStep(const models::Arm& arm, const models::InverseKinematics& inverse,
          const std::vector<description::DriveDescription>& drives, double period_s);

  // Returns the time in which all joints brake together from any speed. It decides how fast the arm approaches the
  // borders of curved sets.
  [[nodiscard]] static double braking_s(const std::vector<description::DriveDescription>& drives) noexcept;

  void set_period(double period_s) noexcept;
  // Starts at rest at these link angles.
  void start(const models::JointVector& link_rad) noexcept;
  // Call if the drives couldn't follow: the arm continues from link_rad, with step_rad as its last step.
  void resume(const models::JointVector& link_rad, const models::JointVector& step_rad) noexcept;

  // Makes the sets of the next step.
  void begin(const ArmStepStart& start) noexcept;
  [[nodiscard]] bool contains(const models::Vec3& q_W) noexcept override;
  [[nodiscard]] bool cut(const models::Vec3& q_W, const models::Vec3& q_k1_W, LimitPlane<3>& out) noexcept override;

  enum class Outcome : std::uint8_t {
    reached,  // the tool is at the wanted place, in the wanted orientation
    lags,     // the tool is at the wanted place, and turns later
    held,     // the tool is at the nearest place that the arm can reach
    invalid,  // the wanted pose isn't finite; nothing has changed
  };
  // Moves towards this pose. Precondition: begin() was called for this step.
  Outcome go(const models::Vec3& q_W, const Eigen::Quaterniond& R_WT) noexcept;

  [[nodiscard]] const models::JointVector& link_rad() const noexcept { return link_rad_; }
  [[nodiscard]] const models::JointVector& step_rad() const noexcept { return step_rad_; }
  // The tool's pose and Jacobian at link_rad().
  [[nodiscard]] const models::ToolKinematics& kinematics() const noexcept { return solution_.kinematics; }
  [[nodiscard]] Eigen::Quaterniond R_WT() const noexcept;
  // The limits that were active in the last step.
  [[nodiscard]] const ActiveLimits& active() const noexcept { return active_; }
  [[nodiscard]] std::uint64_t programs() const noexcept { return programs_; }  // quadratic programs solved so far
  [[nodiscard]] int iterations() const noexcept { return solution_.iterations; }
  void archive(fieldbus::StateArchive& state) noexcept;

 private:
  struct Joint {
    double lower_rad, upper_rad, speed_rad_per_s, acceleration_rad_per_s2;
    // per_step_rad: largest step in a period. share: largest step as a share of the distance to the range's end.
    double per_step_rad, share;
  };
  // Half-space a·u ≤ b, added because a solution has left a curved set.
  struct Row {
    models::JointVector a;
    double b;
    Limit limit;
  };
  // The tool's kinematics, linearised at the step u: x(u') ≈ x + J_p (u' − u). J_R approximates the rotation likewise.
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
  models::JointVector cost_;  // cost of each joint's step, added to the cost of turning
  PlaceMargin margin_;
  double period_s_ = 0.0;
  double brakes_s_;  // result of braking_s()

  // The history from step to step.
  models::JointVector link_rad_, step_rad_;
  bool lags_ = false;
  double catching_rad_per_s_ = 0.0;  // speed at which the tool turns back to a held orientation

  // Values of this step only.
  ArmStepStart start_;
  models::JointVector brakes_;  // the braking step u_b: all joints brake together, the slowest at half its acceleration
  Box whole_, box_;             // whole_: U's box. box_: the part of U's box that is in use
  bool eases_ = false;          // eases(): a small part of U's box is tried first
  double ease_ = 0.0;           // allowed change of a joint's step in box_, in halves of the joint's acceleration
  models::ToolKinematics from_;  // kinematics at c(k−1)
  // During the step: inverse kinematics of the pose last asked for. After the step: the inverse kinematics at its end.
  models::InverseKinematicsResult solution_;
  models::Vec3 asked_W_ = models::Vec3::Zero();
  // The orientation that this step shall reach: R_WT, or one between the present orientation and R_WT.
  Eigen::Quaterniond aim_ = Eigen::Quaterniond::Identity();
  bool asked_ = false, allowed_ = false, catches_up_ = false, linearised_ = false;
  Model model_;
  PlaceMargin::Wrist wrist_;                            // the wrist at the model's step
  models::Vec3 wrist_wanted_W_ = models::Vec3::Zero();  // wrist's position from T, with the tool in orientation aim_
  std::array<Row, 16> rows_;
  std::size_t row_count_ = 0;
  models::NearestInPolyhedron program_;
  // first_set_: index of U's first row in the program. box_rows_: number of the box's rows.
  std::size_t first_set_ = 0, box_rows_ = 0;
  std::array<Limit, models::NearestInPolyhedron::most> kind_{};  // the limits of the rows after the box
  ActiveLimits active_;
  std::uint64_t programs_ = 0;
};

}  // namespace proxarm::controller
