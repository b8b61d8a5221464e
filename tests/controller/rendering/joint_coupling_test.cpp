// The story: the ends of the joints were walls at the tool, where a stretched arm has no lever, so a pull of 1 N led
// the elbow 51 mrad past its range and onto its steel stop.
#include "controller/rendering/joint_coupling.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "controller/rendering/torque_rendering.hpp"
#include "models/geometry/eigenvalues.hpp"
#include "tests/source_file.hpp"

namespace proxarm::controller {
namespace {

using models::JointMatrix;
using models::JointVector;
using models::Vec3;

constexpr double gamma = JointCoupling::stiffness_share, beta = JointCoupling::damping_share;

Eigen::MatrixXd exponential(const Eigen::MatrixXd& A) {
  constexpr int halvings = 12, terms = 16;
  const Eigen::MatrixXd small = A / std::pow(2.0, halvings);
  Eigen::MatrixXd sum = Eigen::MatrixXd::Identity(A.rows(), A.cols()), term = sum;
  for (int k = 1; k < terms; ++k) sum += term = term * small / k;
  for (int k = 0; k < halvings; ++k) sum = sum * sum;
  return sum;
}

// A rotor J that u drives, a gear k, c, and a link I with a hand behind it. u(k+1) is the mean over n of −K x − B ∇x/T
// of the rotor's angle x, and acts for a period.
struct ElasticJoint {
  double rotor, link, frequency_Hz, hand = 0.0;
  double model = 1.0;  // the model's mass over the true one

  [[nodiscard]] double spectral_radius(double T) const {
    const double t = std::max(T, JointCoupling::shortest_s), m = model * (rotor + link);
    const double K = gamma * m / (t * t), B = beta * m / t;
    const double w = 2.0 * M_PI * frequency_Hz, k = link * w * w, c = 0.1 * link * w, I = link + hand;
    Eigen::MatrixXd A = Eigen::MatrixXd::Zero(5, 5);
    A.topRows(4) << 0.0, 1.0, 0.0, 0.0, 0.0,                        //
        -k / rotor, -c / rotor, k / rotor, c / rotor, 1.0 / rotor,  //
        0.0, 0.0, 0.0, 1.0, 0.0,                                    //
        k / I, c / I, -k / I, -c / I, 0.0;
    const auto n = static_cast<Eigen::Index>(JointCoupling::mean_steps(T));
    Eigen::MatrixXd S = Eigen::MatrixXd::Zero(5 + n, 5 + n);  // rotor and link, u, the last n angles
    S.topLeftCorner(4, 5) = exponential(A * T).topRows(4);
    for (Eigen::Index i = 0; i <= n; ++i) {
      const double weight = (i < n ? -(K + B / T) : 0.0) + (i > 0 ? B / T : 0.0);
      S(4, i == 0 ? 0 : 4 + i) = weight / static_cast<double>(n);
    }
    S(5, 0) = 1.0;
    for (Eigen::Index i = 1; i < n; ++i) S(5 + i, 4 + i) = 1.0;
    return models::spectral_radius(S);
  }
};

// Gears that swing at 5 kHz are rigid. A hand's mass makes r up to 1000, a model that is too heavy 0.7.
TEST(JointCoupling, IsStableOnRigidGears) {
  for (const double T : {0.5e-3, 1e-3, 2e-3, 4e-3}) {
    for (const double r : {1.0, 2.0, 10.0, 1000.0}) {
      const ElasticJoint joint{.rotor = 0.01, .link = 0.09, .frequency_Hz = 5000.0, .hand = 0.1 * (r - 1.0)};
      EXPECT_LT(joint.spectral_radius(T), 1.0) << T << " s, r " << r;
    }
    const ElasticJoint lighter{.rotor = 0.01, .link = 0.06, .frequency_Hz = 5000.0, .model = 1.0 / 0.7};
    EXPECT_LT(lighter.spectral_radius(T), 1.0) << T << " s, r 0.7";
  }
}

// As models/cells/light.yaml is simulated: 200 Hz against each joint's own links at the start, with a hand behind them.
TEST(JointCoupling, IsStableOnGearsThatSwing) {
  for (const double link : {0.034, 0.045, 0.06, 0.084, 0.15, 0.27}) {
    for (const double hand : {0.0, 0.05, 0.3, 1.0}) {
      const ElasticJoint joint{.rotor = 0.06, .link = link, .frequency_Hz = 200.0, .hand = hand};
      EXPECT_LT(joint.spectral_radius(1e-3), 1.0) << link << " and " << hand << " kg m²";
    }
  }
}

// A rigid device whose torques act a period later, in a joint space without gravity.
struct JointCouplingTest : ::testing::Test {
  void start(const JointVector& at) {
    q = at;
    v = tau = next = JointVector::Zero(3);
    coupling.start(at);
  }
  void cycle(const Vec3& hand_N, const JointVector& hand_Nm) {
    arm.kinematics(q, tool);
    next = coupling.step(q, tool.J_W, bounds);
    double share = 1.0;
    for (Eigen::Index i = 0; i < 3; ++i) share = std::min(share, most_Nm / std::max(most_Nm, std::abs(next[i])));
    coupling.yield(share);
    const JointVector pushed = tool.J_W.topRows<3>().transpose() * hand_N;
    const JointVector a = arm.mass_matrix(q).llt().solve(tau + pushed + hand_Nm);
    q += T * v + 0.5 * T * T * a;
    v += T * a;
    tau = share * next;
  }
  [[nodiscard]] double tool_speed() const { return (tool.J_W.topRows<3>() * v).norm(); }

  static constexpr double T = 1e-3, most_Nm = 18.0;
  description::Cell cell = description::load_cell(source_file("models/cells/light.yaml"));
  models::Arm arm{cell};
  JointCoupling coupling{arm, cell.drives, cell.limits, T};
  JointCoupling::Bounds bounds;
  models::ToolKinematics tool;
  JointVector q, v, tau, next;
  const JointVector none = JointVector::Zero(3);
};

TEST_F(JointCouplingTest, DoesNothingInsideOfItsSets) {
  start(arm.start_rad());
  for (int i = 0; i < 200; ++i) {  // to 0.15 m/s
    cycle({0.2, 0.1, 0.1}, none);
    ASSERT_EQ(next.cwiseAbs().maxCoeff(), 0.0) << "not small, nothing";
  }
  EXPECT_GT((q - arm.start_rad()).norm(), 0.01);
}

TEST_F(JointCouplingTest, AJointsEndHoldsWhatItsDriveCan) {
  start(arm.start_rad());
  JointVector pushed = none;
  pushed[2] = 15.0;
  for (int i = 0; i < 3000; ++i) {
    cycle(Vec3::Zero(), pushed);
    EXPECT_LT(q[2], cell.drives[2].range_rad[1]) << i;
  }
  EXPECT_TRUE(coupling.active().has(Limit::joint_range));
  EXPECT_NEAR(next[2], -15.0, 0.1);
  EXPECT_LT(std::abs(next[0]) + std::abs(next[1]), 0.1) << "its torque acts on its own joint";
}

// 1 N along the stretched arm: no lever on any joint.
TEST_F(JointCouplingTest, AStretchedArmStaysWithinItsRange) {
  JointVector stretched = arm.start_rad();
  stretched << 0.0, 0.0, 0.3;
  start(stretched);
  for (int i = 0; i < 5000; ++i) cycle({1.0, 0.0, 0.0}, none);
  EXPECT_GT(q[2], cell.drives[2].range_rad[0]);
}

TEST_F(JointCouplingTest, BoundsTheToolsSpeed) {
  start(arm.start_rad());
  double fastest = 0.0;
  for (int i = 0; i < 400; ++i) {
    cycle({0.0, 0.0, 25.0}, none);
    fastest = std::max(fastest, tool_speed());
  }
  EXPECT_LT(fastest, 1.2 * cell.limits.max_tool_speed_m_per_s);
  EXPECT_NEAR(tool_speed(), 0.4 * cell.limits.max_tool_speed_m_per_s, 0.02);
  EXPECT_TRUE(coupling.active().has(Limit::speed));
}

// A hand that overpowers a drive and lets go: only the stretch of the coupling pulls the device back, 15 mrad, and it
// coasts on at the tool's speed limit, without friction here.
TEST_F(JointCouplingTest, WindsNothingUp) {
  start(arm.start_rad());
  JointVector pushed = none;
  pushed[0] = 19.0;
  for (int i = 0; i < 300; ++i) cycle(Vec3::Zero(), pushed);
  const double there = q[0];
  ASSERT_GT(there, 0.2);
  for (int i = 0; i < 100; ++i) cycle(Vec3::Zero(), none);
  EXPECT_GE(q[0], there - 0.06);
}

TEST_F(JointCouplingTest, HoldsTheJointsWhereTheToolMayNotMove) {
  start(arm.start_rad());
  bounds.tool_speed_m_per_s = 0.0;
  for (int i = 0; i < 1000; ++i) cycle({5.0, -3.0, 4.0}, none);
  EXPECT_LT(v.norm(), 1e-6);
  EXPECT_LT((q - arm.start_rad()).norm(), 5e-3);
  EXPECT_EQ(coupling.active().kinds, 0);
}

// 30 N that nobody holds any more, on 0.4 kg: 0.41 m/s within the 5.5 ms of the mean and the delay. Then the force is
// taken away, and no more than the force: what is left is coasting.
TEST_F(JointCouplingTest, AForceThatLetsGoIsTakenFromTheForceItself) {
  start(arm.start_rad());
  bounds = {.n_W = Vec3::UnitX(), .step_m = 0.07 * T, .force_N = 30.0};
  double fastest = 0.0, given_N = 30.0;
  for (int i = 0; i < 300; ++i) {
    cycle({given_N, 0.0, 0.0}, none);
    EXPECT_GE(coupling.released_N(), 0.0);
    EXPECT_LE(coupling.released_N(), 30.0 * (1.0 + 1e-12));
    given_N = 30.0 - coupling.released_N();
    fastest = std::max(fastest, tool_speed());
  }
  EXPECT_LT(fastest, 0.45);
  EXPECT_LT(given_N, 1.0);
  EXPECT_LT(tool_speed(), 0.4 * cell.limits.max_tool_speed_m_per_s);
  EXPECT_LT(next.norm(), 1e-9) << "nothing but the force";
}

TEST_F(JointCouplingTest, AJointBeyondItsEndMovesInwardsOnly) {
  JointVector beyond = arm.start_rad();
  beyond[0] = cell.drives[0].range_rad[1] + 3e-3;
  start(beyond);
  cycle(Vec3::Zero(), none);
  EXPECT_EQ(next.norm(), 0.0) << "it isn't thrown back";
  JointVector pushed = none;
  pushed[0] = 5.0;
  for (int i = 0; i < 1000; ++i) cycle(Vec3::Zero(), pushed);
  EXPECT_NEAR(next[0], -5.0, 0.05);
}

TEST_F(JointCouplingTest, AnglesThatAreNotFiniteChangeNothing) {
  start(arm.start_rad());
  arm.kinematics(q, tool);
  JointVector wrong = q;
  wrong[1] = std::nan("");
  EXPECT_EQ(coupling.step(wrong, tool.J_W, bounds).norm(), 0.0);
  EXPECT_EQ(coupling.step(q, tool.J_W, bounds).norm(), 0.0);
}

// Gravity first, then the limits, then what is rendered.
TEST(TorqueShare, GravityComesFirstThenTheLimits) {
  JointVector most(2), base(2), limits(2), rendered(2), none = JointVector::Zero(2);
  most << 18.0, 18.0;
  base << 3.0, 0.0;
  limits << -30.0, 0.0;
  rendered << 40.0, 4.0;
  std::uint8_t cut = 0;
  const double held = torque_share(limits, base, none, most, cut);
  EXPECT_DOUBLE_EQ(held, 21.0 / 30.0);
  EXPECT_EQ(cut, 1u);
  // The wall takes all: nothing is left to push through it with, though the sum would have room.
  EXPECT_EQ(torque_share(rendered, base, held * limits, most, cut), 0.0);
  // 10 Nm of a wall leave 18 − 10 − 3 of 40, in both joints alike.
  limits << -10.0, 0.0;
  EXPECT_DOUBLE_EQ(torque_share(rendered, base, limits, most, cut), 5.0 / 40.0);
  base << 20.0, 0.0;
  EXPECT_EQ(torque_share(rendered, base, none, most, cut), 0.0) << "a weight that takes all";
}

}  // namespace
}  // namespace proxarm::controller
