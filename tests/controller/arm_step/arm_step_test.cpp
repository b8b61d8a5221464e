// One step of the arm: does it keep its sets, and does an arm come back that was led where it can't go?
#include "controller/arm_step/arm_step.hpp"

#include <gtest/gtest.h>

#include <Eigen/SVD>

#include <algorithm>
#include <cmath>
#include <string>

#include "controller/limits/limit_sets.hpp"
#include "controller/setpoints/link_filter.hpp"
#include "models/geometry/tool_pose.hpp"
#include "tests/models/arm/few_axes.hpp"
#include "tests/models/surfaces/random_states.hpp"

namespace proxarm::controller {
namespace {

using models::JointVector;
using models::Vec3;
using tests::Random;
using tests::scaled;

constexpr double T = 1e-3;

// An arm that is led by a mass of 4 kg on a spring, through no more than its step and its filter.
class LedArm {
 public:
  explicit LedArm(const std::string& cell_name)
      : cell_(tests::shipped_cell(cell_name)),
        arm_(cell_),
        inverse_(arm_),
        step_(arm_, inverse_, cell_.drives, T),
        filter_(cell_.limits.setpoint_bandwidth_Hz, T) {
    filter_.start(arm_.start_rad());
    last_step_ = JointVector::Zero(arm_.axes());
    start_W_ = q_k1_W_ = q_k2_W_ = step_.kinematics().X_WT.translation();
    R_WT_ = step_.R_WT();
  }

  // One cycle under this force.
  void cycle(const Vec3& force_W) {
    step_.begin({.coasting_rad = filter_.coasting_rad(),
                 .input_s2 = filter_.input_s2(),
                 .twist_rad = JointVector::Zero(arm_.axes()),
                 .tool_m_per_s = cell_.limits.max_tool_speed_m_per_s,
                 .elbow_m_per_s = cell_.limits.max_elbow_speed_m_per_s,
                 .R_WT = R_WT_,
                 .held = true,
                 .turn = {R_WT_, 0.1, {}, 2.0, T}});
    const Vec3 p_hat_W = 2.0 * q_k1_W_ - q_k2_W_ + T * T / mass_kg * force_W;
    StepLimits limits;
    limits.arm = &step_;
    limits.q_k1_W = q_k1_W_;
    limits.hard[limits.hard_count++] = {Vec3::Zero(), 0.45 * T, Limit::speed};
    LimitSets<3> sets;
    sets.set(limits, models::Mat3::Identity());
    Vec3 way = p_hat_W - q_k1_W_;
    if (!sets.contains(way, 1e-12, true) || !sets.followed(way, p_hat_W)) {
      int sweeps = 100;
      way = sets.nearest(way, true, sweeps).x;
    }
    const JointVector before = step_.link_rad();
    EXPECT_NE(step_.go(q_k1_W_ + way, R_WT_), ArmStep::Outcome::invalid);
    const JointVector step = step_.link_rad() - before;
    worst_step_ = std::max(worst_step_, share_of_speed(step));
    worst_change_ = std::max(worst_change_, share_of_acceleration(step - last_step_));
    last_step_ = step;
    filter_.step(step_.link_rad());
    q_k2_W_ = q_k1_W_;
    q_k1_W_ = step_.kinematics().X_WT.translation();
  }

  [[nodiscard]] double share_of_speed(const JointVector& step) const {
    double most = 0.0;
    for (Eigen::Index i = 0; i < step.size(); ++i) {
      most = std::max(most, std::abs(step[i]) / T / cell_.drives[static_cast<std::size_t>(i)].max_speed_rad_per_s);
    }
    return most;
  }
  [[nodiscard]] double share_of_acceleration(const JointVector& change) const {
    double most = 0.0;
    for (Eigen::Index i = 0; i < change.size(); ++i) {
      const double a = cell_.drives[static_cast<std::size_t>(i)].max_acceleration_rad_per_s2;
      most = std::max(most, std::abs(change[i]) / (a * T * T));
    }
    return most;
  }
  [[nodiscard]] bool within_ranges() const {
    return (step_.link_rad().array() >= arm_.lower_rad().array() - 1e-12).all() &&
           (step_.link_rad().array() <= arm_.upper_rad().array() + 1e-12).all();
  }
  [[nodiscard]] const Vec3& start_W() const { return start_W_; }
  [[nodiscard]] const Vec3& q_W() const { return q_k1_W_; }
  [[nodiscard]] Vec3 v_W() const { return (q_k1_W_ - q_k2_W_) / T; }
  [[nodiscard]] double worst_step() const { return worst_step_; }
  [[nodiscard]] double worst_change() const { return worst_change_; }
  [[nodiscard]] double turned_rad() const { return step_.R_WT().angularDistance(R_WT_); }
  [[nodiscard]] const ArmStep& step() const { return step_; }

 private:
  static constexpr double mass_kg = 4.0;
  description::Cell cell_;
  models::Arm arm_;
  models::InverseKinematics inverse_;
  ArmStep step_;
  LinkFilter filter_;
  Vec3 start_W_, q_k1_W_, q_k2_W_;
  Eigen::Quaterniond R_WT_;
  double worst_step_ = 0.0, worst_change_ = 0.0;
  JointVector last_step_;
};

// A hand of 300 N/m and 40 Ns/m goes 1.5 m out along a random direction, which is beyond every arm's reach, and comes
// back; it has 2 s more to come to rest. The tool is then where the hand is, to what is left of its swing.
void expect_comes_back(const std::string& cell, std::uint64_t seed) {
  Random random(seed);
  for (std::int64_t k = 0; k < scaled(6, 2); ++k) {
    LedArm arm(cell);
    Vec3 way(random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0), random.uniform(-0.6, 1.0));
    way = 1.0 / way.norm() * way;
    if (way.x() < 0.0) way.x() = -way.x();  // not through the base
    double furthest_m = 0.0;
    for (int cycle = 0; cycle < 11000; ++cycle) {
      const double t = cycle * T, share = t < 4.0 ? t / 4.0 : t < 5.0 ? 1.0 : t < 9.0 ? (9.0 - t) / 4.0 : 0.0;
      const Vec3 force_W = 300.0 * (arm.start_W() + 1.5 * share * way - arm.q_W()) - 40.0 * arm.v_W();
      arm.cycle(force_W);
      ASSERT_TRUE(arm.q_W().allFinite() && arm.within_ranges()) << cell << " " << k << " " << t;
      furthest_m = std::max(furthest_m, (arm.q_W() - arm.start_W()).norm());
    }
    EXPECT_GT(arm.step().programs(), 0u) << cell << " " << k;
    EXPECT_GT(furthest_m, 0.1) << cell << " " << k;
    EXPECT_LT((arm.q_W() - arm.start_W()).norm(), 1e-4) << cell << " " << k << " " << way.transpose();
    EXPECT_LE(arm.worst_step(), 1.0) << cell << " " << k;
    EXPECT_LT(arm.turned_rad(), 1e-6) << cell << " " << k;
  }
}

TEST(ArmStep, AnArmThatIsLedBeyondItsReachComesBack) { expect_comes_back("default", 61); }
TEST(ArmStep, ACobotThatIsLedBeyondItsReachComesBack) { expect_comes_back("cobot", 62); }
TEST(ArmStep, SevenAxesThatAreLedBeyondTheirReachComeBack) { expect_comes_back("seven", 63); }

// Led through its wrist's singularity and back, at 0.19 m/s, a cobot turns its wrist gently: motors lead the links that
// they accelerate, and what jumps from step to step asks more of them than they have (by a factor of 40, once). The
// place goes on as if nothing was there.
TEST(ArmStep, AWristIsLedThroughItsSingularityWithoutAJump) {
  LedArm arm("cobot");
  const Vec3 way(-0.33017, -0.58992, 0.30096);
  const double wrist_before = arm.step().link_rad()[4];
  double wrist_beyond = wrist_before, most_behind_m = 0.0;
  for (int cycle = 0; cycle < 9000; ++cycle) {
    const double t = cycle * T, share = t < 4.0 ? t / 4.0 : std::max(0.0, (8.0 - t) / 4.0);
    const Vec3 behind = arm.start_W() + share * way - arm.q_W();
    arm.cycle(1400.0 * behind - 40.0 * arm.v_W());
    if (t > 0.5) most_behind_m = std::max(most_behind_m, behind.norm());
    wrist_beyond = std::max(wrist_beyond, arm.step().link_rad()[4]);
  }
  EXPECT_LT(wrist_before, -1.5);
  EXPECT_GT(wrist_beyond, 0.05);
  EXPECT_LE(arm.worst_change(), 1.0);
  EXPECT_LT(most_behind_m, 0.02);  // 2v√(M/k), which reversing it at once makes
  EXPECT_LT((arm.q_W() - arm.start_W()).norm(), 1e-4);
  EXPECT_LT(arm.turned_rad(), 1e-6);
}

// Leaned on with 40 N the border keeps still: no more than rounding of the program moves it.
TEST(ArmStep, ABorderOfTheReachStandsUnderASteadyForce) {
  LedArm arm("default");
  const auto lean = [&] { arm.cycle(Vec3(40.0, 0.0, 0.0) - 40.0 * arm.v_W()); };
  for (int cycle = 0; cycle < 20000; ++cycle) lean();
  const Vec3 there = arm.q_W();
  double most_m = 0.0;
  for (int cycle = 0; cycle < 2000; ++cycle) {
    lean();
    most_m = std::max(most_m, arm.v_W().norm() * T);
  }
  EXPECT_GT((there - arm.start_W()).norm(), 0.4);
  EXPECT_LT(most_m, 1e-7);
}

// Where no limit acts the step is that of the inverse kinematics, to the bit.
TEST(ArmStep, AStepThatNoSetTouchesIsTheInverseKinematics) {
  const description::Cell cell = tests::shipped_cell("default");
  const models::Arm arm(cell);
  const models::InverseKinematics inverse(arm);
  ArmStep step(arm, inverse, cell.drives, T);
  Random random(64);
  models::InverseKinematicsResult result;
  JointVector link = arm.start_rad();
  arm.kinematics(link, result.kinematics);
  const Eigen::Quaterniond R = step.R_WT();
  Vec3 at = step.kinematics().X_WT.translation();
  for (int cycle = 0; cycle < 200; ++cycle) {
    LinkFilter filter(25.0, T);
    filter.start(link);
    step.begin({.coasting_rad = filter.coasting_rad(),
                .input_s2 = filter.input_s2(),
                .twist_rad = JointVector::Zero(6),
                .R_WT = R,
                .turn = {R, 0.1, {}, 2.0, T}});
    at += Vec3(random.uniform(-1e-5, 1e-5), random.uniform(-1e-5, 1e-5), random.uniform(-1e-5, 1e-5));
    models::Pose X_WT = models::Pose::Identity();
    X_WT.translation() = at;
    X_WT.linear() = R.toRotationMatrix();
    inverse.solve(link, X_WT, result);
    link = result.q;
    ASSERT_EQ(step.go(at, R), ArmStep::Outcome::reached);
    ASSERT_EQ(step.link_rad(), link) << cycle;
  }
  EXPECT_EQ(step.programs(), 0u);
}

// 1e-4 rad/s: what steps that are linearised leave.
TEST(ArmStep, SevenAxesThatAreQuickTurnTheToolNoFasterThanItsLimit) {
  const description::Cell cell = tests::shipped_cell("seven");
  const models::Arm arm(cell);
  const models::InverseKinematics inverse(arm);
  constexpr double most_rad_per_s = 0.09;
  Random random(67);
  int limited = 0;
  double fastest = 0.0;
  for (auto n = scaled(300); n > 0; --n) {
    ArmStep step(arm, inverse, cell.drives, T);
    LinkFilter filter(cell.limits.setpoint_bandwidth_Hz, T);
    filter.start(arm.start_rad());
    const Eigen::Quaterniond home = step.R_WT();
    Vec3 q_W = step.kinematics().X_WT.translation(), v_W = Vec3::Zero();
    for (int k = 0; k < 120; ++k) {
      v_W += T * random.uniform(0.0, 20.0) * random.direction<3>();
      if (v_W.norm() > 0.45) v_W *= 0.45 / v_W.norm();
      const Eigen::Quaterniond from = step.R_WT();
      const Eigen::Quaterniond wanted = from * models::rotation_by(random.uniform(0.0, 8e-5) * random.direction<3>());
      step.begin({.coasting_rad = filter.coasting_rad(),
                  .input_s2 = filter.input_s2(),
                  .twist_rad = JointVector::Zero(arm.axes()),
                  .tool_m_per_s = 0.5,
                  .elbow_m_per_s = 0.5,
                  .R_WT = wanted,
                  .held = false,
                  .turn = {home, 0.5, {}, most_rad_per_s, T}});
      const auto outcome = step.go(q_W + T * v_W, wanted);
      ASSERT_NE(outcome, ArmStep::Outcome::invalid);
      q_W = step.kinematics().X_WT.translation();
      filter.step(step.link_rad());
      limited += outcome != ArmStep::Outcome::reached;
      fastest = std::max(fastest, from.angularDistance(step.R_WT()) / T);
    }
  }
  EXPECT_GT(limited, scaled(1000));
  EXPECT_LT(fastest, most_rad_per_s + 1e-4);
}

TEST(ArmStep, RefusesAPlaceThatIsNone) {
  const description::Cell cell = tests::shipped_cell("default");
  const models::Arm arm(cell);
  const models::InverseKinematics inverse(arm);
  ArmStep step(arm, inverse, cell.drives, T);
  const JointVector before = step.link_rad();
  step.begin({.coasting_rad = before, .input_s2 = 1e-6, .twist_rad = JointVector::Zero(6), .R_WT = step.R_WT()});
  EXPECT_EQ(step.go(Vec3(NAN, 0.0, 0.0), step.R_WT()), ArmStep::Outcome::invalid);
  EXPECT_EQ(step.link_rad(), before);
}

PlaceMargin margin_of(const models::Arm& arm, const JointVector& c) {
  PlaceMargin margin(arm, models::tool_space(arm));
  models::ToolKinematics at;
  arm.kinematics(c, at);
  margin.go_to(c, at);
  return margin;
}

const PlaceMargin::Border& smallest(const PlaceMargin& margin) { return margin.near().front(); }

// σ falls to nearly nothing as the elbow stretches, and its gradient is that of finite differences of the whole.
TEST(PlaceMargin, SeesAnElbowThatStretchesAndAWristAboveTheBase) {
  const models::Arm arm(tests::shipped_cell("default"));
  const auto margin_at = [&](const JointVector& c) { return margin_of(arm, c); };
  JointVector stretched = arm.start_rad();
  stretched[2] = -1.3;  // nearly straight
  const PlaceMargin margin = margin_at(stretched);
  ASSERT_FALSE(margin.near().empty());
  EXPECT_LT(smallest(margin).value, 0.15);
  for (Eigen::Index i = 0; i < 6; ++i) {
    JointVector more = stretched, less = stretched;
    more[i] += 1e-4;
    less[i] -= 1e-4;
    const double slope = (smallest(margin_at(more)).value - smallest(margin_at(less)).value) / 2e-4;
    EXPECT_NEAR(smallest(margin).gradient[i], slope, 1e-4) << i;
  }
  // The wrist's own singularity is none of the place.
  JointVector wrist = arm.start_rad();
  wrist[4] = 0.0;
  EXPECT_TRUE(margin_at(wrist).near().empty());
}

// The last three axes of the cobot don't meet in a point, so that its wrist's joints move the tool while they hold its
// orientation. J_w is then what the whole arm does: the tool's way is measured by its kinematics alone, with the
// wrist's joints where a damped inverse has them turn it back.
TEST(PlaceMargin, KnowsHowAToolMovesThatIsHeldByAWristWhoseAxesDontMeet) {
  const description::Cell cell = tests::shipped_cell("cobot");
  const models::Arm arm(cell);
  const models::InverseKinematics inverse(arm);
  const PlaceMargin margin(arm, inverse.space());
  Random random(71);
  models::ToolKinematics from, to;
  for (std::int64_t k = 0; k < scaled(400, 100); ++k) {
    JointVector q(6), u = JointVector::Zero(6);
    for (Eigen::Index i = 0; i < 6; ++i) q[i] = random.uniform(arm.lower_rad()[i], arm.upper_rad()[i]);
    for (Eigen::Index i = 0; i < 3; ++i) u[i] = random.uniform(-1.0, 1.0);
    arm.kinematics(q, from);
    const models::Mat3 turns = from.J_W.block<3, 3>(3, 3);
    const models::Mat3 damped = turns * turns.transpose() + 0.3 * 0.3 * models::Mat3::Identity();
    u.tail<3>() = -turns.transpose() * damped.ldlt().solve(from.J_W.block<3, 3>(3, 0) * u.head<3>());
    constexpr double nudge = 1e-6;
    arm.kinematics(q + nudge * u, to);
    const PlaceMargin::Wrist wrist = margin.wrist(from);
    const auto point_W = [&](const models::ToolKinematics& at) {
      return Vec3(at.X_WT.translation() + at.X_WT.linear() * from.X_WT.linear().transpose() * wrist.from_T_W);
    };
    // Second differences of an arm of 1 m, with joints at up to 4 rad/s: 1e-5 m.
    EXPECT_LT((wrist.J_W * u - (point_W(to) - point_W(from)) / nudge).norm(), 2e-5) << k;
  }
}

// Its margin is near where the wrist comes above the base, and the gradient, in which the wrist's joints have a share,
// is that of finite differences.
TEST(PlaceMargin, SeesTheSingularitiesOfAWristWhoseAxesDontMeet) {
  const models::Arm arm(tests::shipped_cell("cobot"));
  const auto margin_at = [&](const JointVector& c) { return margin_of(arm, c); };
  Random random(72);
  int near = 0, by_the_wrist = 0;
  for (std::int64_t k = 0; k < scaled(2000, 500) && near < 40; ++k) {
    JointVector q(6);
    for (Eigen::Index i = 0; i < 6; ++i) q[i] = random.uniform(arm.lower_rad()[i], arm.upper_rad()[i]);
    const PlaceMargin margin = margin_at(q);
    // Where two singular values meet, there is no gradient: they are well below those of the rest.
    if (margin.near().empty() || smallest(margin).value > 0.05 || std::abs(std::sin(q[4])) < 0.3) continue;
    ++near;
    for (Eigen::Index i = 0; i < 6; ++i) {
      JointVector more = q, less = q;
      more[i] += 1e-5;
      less[i] -= 1e-5;
      const double slope = (smallest(margin_at(more)).value - smallest(margin_at(less)).value) / 2e-5;
      EXPECT_NEAR(smallest(margin).gradient[i], slope, 1e-3) << k << " " << i;
      if (i > 2 && std::abs(slope) > 0.02) ++by_the_wrist;
    }
  }
  EXPECT_GT(near, 5);
  EXPECT_GT(by_the_wrist, 0);
}

// Where nothing is near, a determinant says so; it never says so where σ is below the border of what is near.
TEST(PlaceMargin, IsNeverCalledClearWhereItIsNear) {
  const description::Cell cell = tests::shipped_cell("cobot");
  const models::Arm arm(cell);
  const models::InverseKinematics inverse(arm);
  PlaceMargin margin(arm, inverse.space());
  Random random(73);
  models::ToolKinematics at;
  int clear = 0, poses = 0;
  for (std::int64_t k = 0; k < scaled(4000, 1000); ++k) {
    JointVector q(6);
    for (Eigen::Index i = 0; i < 6; ++i) q[i] = random.uniform(arm.lower_rad()[i], arm.upper_rad()[i]);
    arm.kinematics(q, at);
    margin.go_to(q, at);
    const Eigen::JacobiSVD<Eigen::MatrixXd> svd(Eigen::MatrixXd(margin.wrist(at).J_W));
    EXPECT_EQ(margin.near().empty(), svd.singularValues()[2] >= margin.least() + 0.1) << k;
    clear += margin.near().empty() ? 1 : 0;
    ++poses;
  }
  EXPECT_GT(clear, poses / 4);
}

// A small arm was thrown where its two smallest singular values changed places: the one that had been further off
// became the border, unseen until then. Each that is near has a border of its own, with the slope that it has by finite
// differences of singular values that another method finds.
TEST(PlaceMargin, GivesEachSmallSingularValueABorderOfItsOwn) {
  const models::Arm arm(tests::shipped_cell("cobot"));
  PlaceMargin margin(arm, models::tool_space(arm));
  models::ToolKinematics at;
  const auto values_at = [&](const JointVector& q) {
    arm.kinematics(q, at);
    const Vec3 falling = Eigen::JacobiSVD<Eigen::MatrixXd>(Eigen::MatrixXd(margin.wrist(at).J_W)).singularValues();
    return Vec3(falling.reverse());
  };
  Random random(74);
  int two_near = 0;
  for (std::int64_t k = 0; k < scaled(40000, 20000) && two_near < 20; ++k) {
    JointVector q(6);
    for (Eigen::Index i = 0; i < 6; ++i) q[i] = random.uniform(arm.lower_rad()[i], arm.upper_rad()[i]);
    const Vec3 values = values_at(q);
    margin.go_to(q, at);
    ASSERT_EQ(margin.near().size(), static_cast<std::size_t>((values.array() < margin.least() + 0.1).count())) << k;
    // Apart by so much that both have a slope, over 1e-5 rad, to the digits that are asked for below.
    if (margin.near().size() < 2 || values[1] - values[0] < 0.02 || values[0] < 0.01) continue;
    ++two_near;
    for (int b = 0; b < 2; ++b) {
      const PlaceMargin::Border& border = margin.near()[static_cast<std::size_t>(b)];
      EXPECT_NEAR(border.value, values[b], 1e-9) << k << " " << b;
      for (Eigen::Index i = 0; i < 6; ++i) {
        JointVector more = q, less = q;
        more[i] += 1e-5;
        less[i] -= 1e-5;
        const double slope = (values_at(more)[b] - values_at(less)[b]) / 2e-5;
        EXPECT_NEAR(border.gradient[i], slope, 1e-3) << k << " " << b << " " << i;
      }
    }
  }
  EXPECT_GE(two_near, 5);
}

}  // namespace
}  // namespace proxarm::controller
