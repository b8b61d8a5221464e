#include "models/arm/inverse_kinematics.hpp"

#include <gtest/gtest.h>

#include <Eigen/SVD>
#include <chrono>

#include "models/base/setup_error.hpp"
#include "tests/allocation_count.hpp"
#include "tests/models/surfaces/random_states.hpp"
#include "tests/source_file.hpp"

namespace proxarm::models {
namespace {

using Status = InverseKinematicsResult::Status;
using tests::Random;

description::Cell default_cell() { return description::load_cell(source_file("models/cells/default.yaml")); }

class InverseKinematicsTest : public testing::Test {
 protected:
  JointVector random_angles(Random& random) const {
    JointVector q(6);
    for (int i = 0; i < 6; ++i) q[i] = random.uniform(arm.lower_rad()[i], arm.upper_rad()[i]);
    return q;
  }

  // Smallest singular value of the weighted Jacobian, from the singular value decomposition.
  double smallest(const JointVector& q, Vec<6>* direction = nullptr) const {
    ToolKinematics at_q;
    arm.kinematics(q, at_q);
    Eigen::Matrix<double, 6, 6> J = at_q.J_W;
    J.bottomRows<3>() *= config.length_m;
    const Eigen::JacobiSVD<Eigen::Matrix<double, 6, 6>> svd(J, Eigen::ComputeFullU | Eigen::ComputeFullV);
    if (direction != nullptr) *direction = svd.matrixU().col(5);
    return svd.singularValues()[5];
  }

  double miss_m(const JointVector& q, const Pose& X) const {
    return (arm.tool_pose(q).translation() - X.translation()).norm();
  }

  Arm arm{default_cell()};
  InverseKinematicsConfig config;
};

// A pose near another: up to `metres` and `radians` away.
Pose nearby(Random& random, const Pose& X, double metres, double radians) {
  Pose Y = X;
  Y.translation() += random.uniform(0.0, metres) * random.direction<3>();
  Y.linear() = Eigen::AngleAxisd(random.uniform(0.0, radians), random.direction<3>()).toRotationMatrix() * X.linear();
  return Y;
}

TEST_F(InverseKinematicsTest, FindsItsWayBackFromRandomStates) {
  const InverseKinematics ik(arm, config);
  Random random(201);
  InverseKinematicsResult result;
  std::int64_t regular = 0, iterations = 0;
  const auto count = tests::scaled(1e5);
  for (auto n = count; n > 0; --n) {
    const JointVector q = random_angles(random);
    JointVector from = q;
    for (int i = 0; i < 6; ++i) from[i] += random.uniform(-0.002, 0.002);
    const Pose X = arm.tool_pose(q);
    ik.solve(from, X, result);
    ASSERT_TRUE(result.q.allFinite());
    ASSERT_LE((result.q - from).cwiseAbs().maxCoeff(), config.max_step_rad[0] * (1.0 + 1e-12) + 1e-15);
    // 0.05 m/rad: Newton from 2 mrad away certainly converges there, and to the same solution.
    if (smallest(q) < 0.05) continue;
    ++regular;
    iterations += result.iterations;
    ASSERT_EQ(result.status, Status::converged) << q.transpose();
    ASSERT_LE(result.position_residual_m, 1e-12);
    ASSERT_LE(result.rotation_residual_rad, 1e-12);
    ASSERT_LE(miss_m(result.q, X), 1e-12);
    ASSERT_LT((result.q - q).cwiseAbs().maxCoeff(), 1e-10);  // 1e-12 m over 0.05 m/rad, and some
  }
  EXPECT_GT(regular, count / 3);
  RecordProperty("iterations_per_solution",
                 std::to_string(static_cast<double>(iterations) / static_cast<double>(regular)));
}

TEST_F(InverseKinematicsTest, ConvergesQuadratically) {
  Random random(202);
  int checked = 0;
  while (checked < 200) {
    const JointVector q = random_angles(random);
    if (smallest(q) < 0.1) continue;
    const Pose X = nearby(random, arm.tool_pose(q), 5e-3, 5e-3);
    // One step a call: with tolerances that nothing meets, Newton gives up after its one step and the least damped step
    // from the same start, which is the same but for 1e-16, is what comes back.
    InverseKinematicsConfig single = config;
    single.max_step_rad.fill(1.0);
    single.max_iterations = single.max_damped_iterations = 1;
    single.position_tolerance_m = single.rotation_tolerance_rad = 1e-300;
    const InverseKinematics ik(arm, single);
    InverseKinematicsResult result;
    JointVector at = q;
    double before = 0.0;
    for (int n = 0; n < 3; ++n) {
      ik.solve(at, X, result);
      at = result.q;
      const double residual = std::hypot(result.position_residual_m, result.rotation_residual_rad);
      // e' ≤ C e² with C = curvature over σ_min², at most 100 /m here; below 1e-14 is rounding.
      if (n > 0) {
        EXPECT_LT(residual, std::max(100.0 * before * before, 1e-14));
      }
      before = residual;
    }
    ++checked;
  }
}

TEST_F(InverseKinematicsTest, StaysWhereItIsWhenTheTargetIsReached) {
  const InverseKinematics ik(arm, config);
  Random random(203);
  InverseKinematicsResult result;
  for (auto n = tests::scaled(1000); n > 0; --n) {
    const JointVector q = random_angles(random);
    ik.solve(q, arm.tool_pose(q), result);
    ASSERT_EQ(result.status, Status::converged);
    ASSERT_EQ(result.q, q);  // to the bit
    ASSERT_EQ(result.iterations, 0);
  }
  // Even in a singularity: the wrist stretched.
  JointVector q(6);
  q << 0.3, 0.2, 0.4, 0.5, 0.0, -0.2;
  ik.solve(q, arm.tool_pose(q), result);
  EXPECT_EQ(result.status, Status::converged);
  EXPECT_EQ(result.q, q);
  ik.measure_singularity(result);
  EXPECT_LT(result.smallest_singular_value_m_per_rad, 1e-10);
}

TEST_F(InverseKinematicsTest, NeverJumpsAndNeverGivesNan) {
  // Targets anywhere, from anywhere, singular starts among them; tight and wide limits.
  Random random(204);
  InverseKinematicsResult result;
  for (auto n = tests::scaled(2e4); n > 0; --n) {
    InverseKinematicsConfig limits;
    for (double& step : limits.max_step_rad) step = random.log_uniform(1e-5, 0.5);
    const InverseKinematics ik(arm, limits);
    JointVector q = random_angles(random);
    if (random.chance(0.3)) q[4] = random.chance(0.5) ? 0.0 : random.log_uniform(1e-14, 1e-3);  // wrist stretched
    if (random.chance(0.1))
      q[2] = -1.3734007669450159;  // elbow stretched: forearm's atan(0.12+0.48, 0.1) from upper arm
    const double size = random.log_uniform(1e-9, 3.0);
    const Pose X = nearby(random, arm.tool_pose(q), size, size);
    ik.solve(q, X, result);
    ASSERT_TRUE(result.q.allFinite());
    ik.measure_singularity(result);
    ASSERT_TRUE(result.lost_direction_W.allFinite());
    ASSERT_TRUE(std::isfinite(result.smallest_singular_value_m_per_rad));
    ASSERT_NE(result.status, Status::invalid);
    for (int i = 0; i < 6; ++i) {
      // The last place of angles up to 5 rad.
      ASSERT_LE(std::abs(result.q[i] - q[i]), limits.max_step_rad[static_cast<std::size_t>(i)] + 1e-15);
    }
    ASSERT_NEAR(result.position_residual_m, miss_m(result.q, X), 1e-12);
    if (result.status == Status::converged) {
      ASSERT_LE(result.position_residual_m, 1e-12);
      ASSERT_LE(result.rotation_residual_rad, 1e-12);
    }
  }
}

TEST_F(InverseKinematicsTest, ReportsTheSmallestSingularValueAndItsDirection) {
  const InverseKinematics ik(arm, config);
  Random random(205);
  InverseKinematicsResult result;
  for (auto n = tests::scaled(2000); n > 0; --n) {
    JointVector q = random_angles(random);
    if (random.chance(0.5)) q[4] = random.log_uniform(1e-6, 0.1);
    Vec<6> direction;
    const double exact = smallest(q, &direction);
    ik.solve(q, arm.tool_pose(q), result);
    ik.measure_singularity(result);
    ASSERT_GE(result.smallest_singular_value_m_per_rad, exact * (1.0 - 1e-6));
    if (exact < 0.02) {
      ASSERT_LE(result.smallest_singular_value_m_per_rad, 1.1 * exact) << q.transpose();
      ASSERT_GT(std::abs(direction.dot(result.lost_direction_W)), 0.9);
    }
  }
}

TEST_F(InverseKinematicsTest, LagsOnlyInTheLostDirectionAtASingularity) {
  // Wrist stretched (axes 4 and 6 in one line). Around the axis that is lost the tool can't turn at once; all else it
  // can.
  config.max_step_rad.fill(5e-3);
  const InverseKinematics ik(arm, config);
  JointVector q(6);
  q << 0.3, 0.2, 0.4, 0.5, 0.0, -0.2;
  Vec<6> lost;
  smallest(q, &lost);
  Pose X = arm.tool_pose(q);
  InverseKinematicsResult result;
  // A motion orthogonal to it is followed as if there were no singularity.
  Vec<6> e = Vec<6>::Constant(1e-4);
  e -= lost * lost.dot(e);
  X.translation() += e.head<3>();
  const Vec3 w = e.tail<3>() / config.length_m;
  X.linear() = Eigen::AngleAxisd(w.norm(), w.normalized()).toRotationMatrix() * X.linear();
  ik.solve(q, X, result);
  EXPECT_LT(result.position_residual_m, 1e-7);  // second order of 1e-4
  EXPECT_LT(result.rotation_residual_rad, 1e-6);
  // One along it is not, but nothing jumps, and in the end the tool gets there.
  JointVector at = q;
  X = arm.tool_pose(q);
  const Vec3 turn = 0.02 * lost.tail<3>().normalized();
  X.linear() = Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix() * X.linear();
  X.translation() += 1e-3 * Vec3(0.5, -0.3, 0.8);
  int cycles = 0;
  do {
    ik.solve(at, X, result);
    ASSERT_LE((result.q - at).cwiseAbs().maxCoeff(), 5e-3 + 1e-15);
    at = result.q;
  } while (result.status != Status::converged && ++cycles < 2000);
  RecordProperty("cycles", cycles);
  EXPECT_EQ(result.status, Status::converged) << "after " << cycles << " cycles, " << result.rotation_residual_rad;
}

TEST_F(InverseKinematicsTest, OutOfReachIsSaidAndTheArmStretchesTowardsIt) {
  const InverseKinematics ik(arm, config);
  InverseKinematicsResult result;
  JointVector q = arm.start_rad();
  Pose X = arm.tool_pose(q);
  X.translation() += Vec3(3.0, 0.0, 0.0);
  double before = 1e9;
  for (int cycle = 0; cycle < 3000; ++cycle) {
    ik.solve(q, X, result);
    ASSERT_NE(result.status, Status::converged);
    ASSERT_LE(result.position_residual_m + config.length_m * result.rotation_residual_rad, before * 1.5);
    before = result.position_residual_m + config.length_m * result.rotation_residual_rad;
    ASSERT_LE((result.q - q).cwiseAbs().maxCoeff(), config.max_step_rad[0] + 1e-15);
    q = result.q;
  }
  EXPECT_TRUE(result.status == Status::singular || result.status == Status::not_converged);
  EXPECT_LT(result.position_residual_m, 2.7);
}

TEST_F(InverseKinematicsTest, GarbageComesBackAsInvalidWithTheAnglesThatCameIn) {
  const InverseKinematics ik(arm, config);
  InverseKinematicsResult result;
  const JointVector q = arm.start_rad();
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    Pose X = arm.tool_pose(q);
    X.translation().y() = bad;
    ik.solve(q, X, result);
    EXPECT_EQ(result.status, Status::invalid);
    EXPECT_EQ(result.q, q);
    X = arm.tool_pose(q);
    X.linear()(1, 1) = bad;
    ik.solve(q, X, result);
    EXPECT_EQ(result.status, Status::invalid);
    JointVector p = q;
    p[3] = bad;
    ik.solve(p, arm.tool_pose(q), result);
    EXPECT_EQ(result.status, Status::invalid);
  }
  Pose mirror = arm.tool_pose(q);
  mirror.linear().col(0) *= -1.0;
  ik.solve(q, mirror, result);
  EXPECT_EQ(result.status, Status::invalid);
  mirror.linear().setZero();
  ik.solve(q, mirror, result);
  EXPECT_EQ(result.status, Status::invalid);
}

TEST_F(InverseKinematicsTest, FlagsAnglesOutOfTheirRange) {
  const InverseKinematics ik(arm, config);
  InverseKinematicsResult result;
  JointVector q = arm.start_rad();
  ik.solve(q, arm.tool_pose(q), result);
  EXPECT_FALSE(result.out_of_range);
  q[3] = arm.upper_rad()[3] + 1e-9;
  ik.solve(q, arm.tool_pose(q), result);
  EXPECT_TRUE(result.out_of_range);
}

TEST_F(InverseKinematicsTest, FindsAStartPoseFromAnywhere) {
  const InverseKinematics ik(arm, config);
  Random random(206);
  const auto count = tests::scaled(50);
  int found = 0;
  for (auto n = count; n > 0; --n) {
    const JointVector q = random_angles(random);
    const Pose X = arm.tool_pose(q);
    const auto solution = ik.solve_anywhere(X, arm.start_rad());
    if (!solution) continue;
    ++found;
    EXPECT_LE(miss_m(*solution, X), 2e-12);
    for (int i = 0; i < 6; ++i) {
      EXPECT_GE((*solution)[i], arm.lower_rad()[i]);
      EXPECT_LE((*solution)[i], arm.upper_rad()[i]);
    }
  }
  EXPECT_EQ(found, count);
  Pose X = arm.tool_pose(arm.start_rad());
  EXPECT_LT((*ik.solve_anywhere(X, arm.start_rad()) - arm.start_rad()).cwiseAbs().maxCoeff(), 1e-12);
  X.translation() += Vec3(2.0, 0.0, 0.0);
  EXPECT_FALSE(ik.solve_anywhere(X, arm.start_rad()));
}

TEST_F(InverseKinematicsTest, RefusesWhatItCantSolve) {
  description::Cell cell = default_cell();
  cell.drives.resize(1);
  cell.urdf = source_file("tests/models/arm/data/pendulum.urdf");
  cell.drives[0].joint = "hinge";
  cell.sensor.link = "tip";
  const Arm pendulum(cell);
  EXPECT_THROW(InverseKinematics ik(pendulum), description::SetupError);
  config.max_step_rad[2] = -1.0;
  EXPECT_THROW(InverseKinematics ik(arm, config), description::SetupError);
}

TEST_F(InverseKinematicsTest, NeitherItNorTheArmTakesFromTheHeap) {
  if (!tests::allocations_are_counted()) GTEST_SKIP() << "a sanitizer's malloc can't be counted";
  const InverseKinematics ik(arm, config);
  Random random(208);
  InverseKinematicsResult result;
  ToolKinematics at_q;
  double sum = 0.0;
  for (int n = 0; n < 500; ++n) {
    JointVector q = random_angles(random);
    if (n % 3 == 0) q[4] = 0.0;  // damped steps, too
    const double size = random.log_uniform(1e-9, 1.0);
    const Pose X = nearby(random, arm.tool_pose(q), size, size);
    const std::uint64_t before = tests::allocation_count();
    ik.solve(q, X, result);
    arm.kinematics(q, at_q);
    sum += arm.gravity_torque(q)[0] + arm.holding_torque(q, {})[1] + arm.potential_energy(q) +
           arm.mass_matrix(q)(0, 0) + arm.effective_mass(q, Vec3::UnitX()) + arm.effective_mass_range(q).min_kg +
           arm.motor_from_link(q)[2] + arm.motor_from_link(q, Wrench{})[2] + arm.link_from_motor(q)[3] +
           arm.first_elastic_frequency_Hz(q) + arm.sensor_pose(q)(0, 3);
    ASSERT_EQ(tests::allocation_count(), before);
  }
  EXPECT_TRUE(std::isfinite(sum) || sum > 0.0);
}

// Median over repetitions, so that a busy machine doesn't fail it; bounds are ten times what an idle one needs.
TEST_F(InverseKinematicsTest, TimingOfACycle) {
  const InverseKinematics ik(arm, config);
  Random random(207);
  ToolKinematics at_q;
  InverseKinematicsResult result;
  const JointVector start = arm.start_rad();
  const auto median_ns = [](auto&& f) {
    std::vector<double> times;
    for (int repetition = 0; repetition < 51; ++repetition) {
      const auto t0 = std::chrono::steady_clock::now();
      for (int i = 0; i < 200; ++i) f(i);
      times.push_back(std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now() - t0).count() / 200.0);
    }
    std::nth_element(times.begin(), times.begin() + 25, times.end());
    return times[25];
  };
  JointVector q = start;
  double sum = 0.0;
  const double forward = median_ns([&](int i) {
    q[0] = 1e-3 * i;
    arm.kinematics(q, at_q);
    sum += at_q.X_WT(0, 3);
  });
  const Pose X0 = arm.tool_pose(start);
  q = start;
  const double inverse = median_ns([&](int i) {
    Pose X = X0;  // 0.5 m/s at 1 kHz, there and back
    X.translation() += 5e-4 * (i % 100) * Vec3(0.6, 0.0, 0.8);
    if (i % 100 == 0) q = start;
    ik.solve(q, X, result);
    q = result.q;
    sum += result.iterations;
  });
  JointVector singular(6);
  singular << 0.3, 0.2, 0.4, 0.5, 0.0, -0.2;
  Pose X_singular = arm.tool_pose(singular);
  X_singular.linear() = Eigen::AngleAxisd(0.02, Vec3(0.6, 0.0, 0.8)).toRotationMatrix() * X_singular.linear();
  const double damped = median_ns([&](int) {
    ik.solve(singular, X_singular, result);
    sum += result.iterations;
  });
  const double gravity = median_ns([&](int i) {
    q[0] = 1e-3 * i;
    sum += arm.gravity_torque(q)[1];
  });
  const double deflection = median_ns([&](int i) {
    q[0] = 1e-3 * i;
    sum += arm.link_from_motor(q)[1];
  });
  EXPECT_TRUE(std::isfinite(sum));
  std::printf(
      "kinematics and Jacobian %.0f ns, inverse %.0f ns (%d steps), in a singularity %.0f ns, gravity %.0f ns, "
      "link from motor %.0f ns\n",
      forward, inverse, result.iterations, damped, gravity, deflection);
#ifdef __OPTIMIZE__
  if (tests::allocations_are_counted()) {  // no sanitizer
    EXPECT_LT(forward, 1e4);
    EXPECT_LT(inverse, 4e4);
  }
#endif
}

}  // namespace
}  // namespace proxarm::models
