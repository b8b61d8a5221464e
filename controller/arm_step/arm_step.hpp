// One step of the arm, from where it is sent to where it will be sent: the joints' step u as the unknown, and all that
// the arm can't do as sets of it.
//
//   minimise |x(u) − x_d|², and then |R(u) ⊟ R_d|²,   where u ∈ U
// x, R: the tool's pose by exact kinematics at c(k−1) + u, with c the links' angles before the setpoints' filter. The
// sets of U:
//   box      low ≤ u ≤ high: each joint's range with room to brake, its speed, and its acceleration behind the filter.
//            The filter's input may therefore jump, as it does at a wall. Where turning may have to give way (near a
//            wrist's singularity, while it lags, and where a hand turns the tool) steps keep to half of the
//            acceleration before the filter, too, if the place allows it; of an orientation that is held, those of the
//            joints that only turn the tool always. Motors lead the links that they accelerate, and can't follow what
//            jumps at a wrist
//   place    −∇σ·u ≤ b: distance from the poses in which the place is lost (place_margin.hpp)
//   points   |p(u) − p(0)| ≤ vT for elbow and wrist, also while all joints brake from there (growth_m_per_s())
//   turn     the sets of turning (turn_sets.hpp); of an orientation that is held, how far it may lag
// Place and turn are borders: they are approached no faster than joints can brake. All but the box are curved, and
// taken in as half-spaces where a solution has left them.
//
// Place comes before orientation. Where the wrist's joints have not enough left to turn the tool (a wrist's
// singularity), it turns later, and what it lags by is bounded by the sets of turning. But a tool isn't tilted to reach
// further: where the joints that carry the wrist have not enough left, the place gives way. So the places that can be
// followed (FollowableStep) are those to which these joints can carry the wrist with the tool turned as wanted, or,
// where it turns freely, as braking turns it: turning gives way first. The proxy's next place is one of them: q(k) is
// where the arm is sent.
//
// Each half-space is widened to what the joints can still do, so U is never empty for one of them alone; where several
// exclude each other, the joints brake together as hard as they can. A force of U's normal cone has f·(u − u_b) ≤ 0 for
// any step u_b of U: a limit never drives the arm beyond what braking would. That is what lets an arm come back that
// was led where it can't go.
//
// A step that no set touches is that of the inverse kinematics, to the bit. Neither allocates, locks nor throws after
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

// What a step depends on beside the arm's own history. Angles of the links, in rad; the setpoints' filter as
// elastic_setpoint.hpp has it.
struct ArmStepStart {
  models::JointVector coasting_rad;                // the filter's input for which its output keeps its speed
  double input_s2 = 0.0;                           // by how much another input is off from that, for each rad/s²
  models::JointVector twist_rad;                   // by how much each motor is ahead of its link
  double tool_m_per_s = 0.5, elbow_m_per_s = 0.5;  // speed limits of T, and of elbow and wrist
  Eigen::Quaterniond R_WT = Eigen::Quaterniond::Identity();  // the orientation that is wanted
  bool held = true;                                          // it stays the same: what lags is caught up slowly
  bool touches_turning = false;  // contacts turn the tool, so its turning may change at once (a tool with a shape)
  TurnSets turn{};
};

class ArmStep final : public FollowableStep {
 public:
  // Precondition: arm and inverse kinematics outlive this object.
  ArmStep(const models::Arm& arm, const models::InverseKinematics& inverse,
          const std::vector<description::DriveDescription>& drives, double period_s);

  // In which all joints together brake from any speed, and in which the borders of curved sets are approached.
  [[nodiscard]] static double braking_s(const std::vector<description::DriveDescription>& drives) noexcept;

  void set_period(double period_s) noexcept;
  // At rest at these angles of the links.
  void start(const models::JointVector& link_rad) noexcept;
  // The drives couldn't follow: the motion goes on from here with this step.
  void resume(const models::JointVector& link_rad, const models::JointVector& step_rad) noexcept;

  // Makes the sets of the next step.
  void begin(const ArmStepStart& start) noexcept;
  [[nodiscard]] bool contains(const models::Vec3& q_W) noexcept override;
  [[nodiscard]] bool cut(const models::Vec3& q_W, const models::Vec3& q_k1_W, LimitPlane<3>& out) noexcept override;

  enum class Outcome : std::uint8_t {
    reached,  // place and orientation
    lags,     // the place; the tool turns later
    held,     // the place nearest to it that can be followed
    invalid,  // the pose isn't finite; nothing has changed
  };
  // Takes the step towards this pose. Precondition: begin() was called for it.
  Outcome go(const models::Vec3& q_W, const Eigen::Quaterniond& R_WT) noexcept;

  [[nodiscard]] const models::JointVector& link_rad() const noexcept { return link_rad_; }
  [[nodiscard]] const models::JointVector& step_rad() const noexcept { return step_rad_; }
  // The tool at link_rad().
  [[nodiscard]] const models::ToolKinematics& kinematics() const noexcept { return solution_.kinematics; }
  [[nodiscard]] Eigen::Quaterniond R_WT() const noexcept;
  // The limits that held the last step.
  [[nodiscard]] const ActiveLimits& active() const noexcept { return active_; }
  [[nodiscard]] std::uint64_t programs() const noexcept { return programs_; }  // quadratic programs solved so far
  [[nodiscard]] int iterations() const noexcept { return solution_.iterations; }
  void archive(fieldbus::StateArchive& state) noexcept;

 private:
  struct Joint {
    double lower_rad, upper_rad, speed_rad_per_s, acceleration_rad_per_s2;
    double per_step_rad, share;  // of the period: what it may turn, and what share of the way to its range's end
  };
  // A half-space a·u ≤ b in which a solution was found to leave a curved set.
  struct Row {
    models::JointVector a;
    double b;
    Limit limit;
  };
  // The tool around the step u, linearised: x(u') ≈ x + J_p (u' − u), and likewise the rotation.
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

  // Its history.
  models::JointVector link_rad_, step_rad_;
  bool lags_ = false;
  double catching_rad_per_s_ = 0.0;  // how fast a held orientation that lags catches up

  // Of this step.
  ArmStepStart start_;
  models::JointVector brakes_;   // all joints brake together, by half of their acceleration
  Box whole_, box_;              // U's, and the part of it that is used
  bool eases_ = false;           // the first part that is tried is a small one: eases()
  double ease_ = 0.0;            // of that part: by how many times half of its acceleration a joint's step may change
  models::ToolKinematics from_;  // at c(k−1)
  models::InverseKinematicsResult solution_;  // of the pose last asked for; after the step, of where it led
  models::Vec3 asked_W_ = models::Vec3::Zero();
  Eigen::Quaterniond aim_ = Eigen::Quaterniond::Identity();  // what the step turns to: R_WT, or part of the way there
  bool asked_ = false, allowed_ = false, catches_up_ = false, linearised_ = false;
  Model model_;
  PlaceMargin::Wrist wrist_;                            // by the model
  models::Vec3 wrist_wanted_W_ = models::Vec3::Zero();  // from T, with the tool turned as wanted
  std::array<Row, 16> rows_;
  std::size_t row_count_ = 0;
  models::NearestInPolyhedron program_;
  std::size_t first_set_ = 0, box_rows_ = 0;  // the first row of the program that is a set of U; those of the box
  std::array<Limit, models::NearestInPolyhedron::most> kind_{};  // of the rows after the box
  ActiveLimits active_;
  std::uint64_t programs_ = 0;
};

}  // namespace proxarm::controller
