// The guard of the tool against setpoints as bad as they get. Judged by Arm's other functions (tool_pose and
// link_from_motor, which the guard doesn't use), and on the way between two setpoints, too.
#include "controller/setpoints/tool_guard.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <string>

#include "controller/setpoints/joint_guard.hpp"
#include "tests/allocation_count.hpp"
#include "tests/models/surfaces/random_states.hpp"
#include "tests/source_file.hpp"

namespace proxarm::controller {
namespace {

using models::ArmPoints;
using models::JointVector;
using models::Vec3;
using tests::Random;

// What the header promises: half of the 0.1 mm for arcs beyond a border, a tenth of it for the gears' twist.
constexpr double border_m = 6e-5;

// Both guards, one behind the other as the cycle has them, and a judge of what they let through.
class Guarded {
 public:
  Guarded(const description::Cell& cell, double period_s, const JointVector& start_rad)
      : arm(cell),
        limits(cell.limits),
        drives(cell.drives),
        T(period_s),
        joints(cell.drives, period_s),
        tool(arm, cell.drives, cell.limits, period_s),
        theta(start_rad),
        speed(JointVector::Zero(arm.axes())) {
    joints.start(start_rad);
    tool.start(start_rad);
    tool_W = tool_at(theta);
    points = points_at(theta);
  }

  // The share of the wanted setpoint's changes is up to them; what comes out is judged.
  ActiveLimits step(const JointVector& wanted) {
    joints.step(wanted);
    const ActiveLimits active = tool.step(joints.target_rad(), max_speed, nullptr, nullptr);
    if (active.kinds != 0) {
      joints.settle(tool.target_rad(), tool.speed_rad_per_s());
      joints.follow_from_here();
    }
    judge(joints.target_rad());
    return active;
  }

  Vec3 tool_at(const JointVector& motor) const { return arm.tool_pose(arm.link_from_motor(motor)).translation(); }
  ArmPoints points_at(const JointVector& motor) const {
    ArmPoints out;
    arm.points(arm.link_from_motor(motor), out);
    return out;
  }

  models::Arm arm;
  description::CellLimits limits;
  std::vector<description::DriveDescription> drives;
  double T, max_speed = 1e9;
  JointGuard joints;
  ToolGuard tool;
  JointVector theta, speed;
  Vec3 tool_W;
  ArmPoints points;
  double fastest = 0.0, fastest_elbow = 0.0, outside_m = -1e9, inside_m = -1e9;

 private:
  void judge(const JointVector& next) {
    const JointVector u = (next - theta) / T;
    for (Eigen::Index i = 0; i < u.size(); ++i) {
      const auto& drive = drives[static_cast<std::size_t>(i)];
      ASSERT_LE(std::abs(u[i]), drive.max_speed_rad_per_s * (1.0 + 1e-9));
      ASSERT_LE(std::abs(u[i] - speed[i]), drive.max_acceleration_rad_per_s2 * T * (1.0 + 1e-6) + 1e-12 / T);
      ASSERT_LE(next[i], std::max(theta[i], drive.range_rad[1]) + 1e-9);
      ASSERT_GE(next[i], std::min(theta[i], drive.range_rad[0]) - 1e-9);
    }
    const Vec3 next_W = tool_at(next);
    const ArmPoints next_points = points_at(next);
    fastest = std::max(fastest, (next_W - tool_W).norm() / T / limits.max_tool_speed_m_per_s);
    for (std::size_t i = 2; i < static_cast<std::size_t>(u.size()); ++i) {
      const double moved_m = (next_points.joint_W[i] - points.joint_W[i]).norm();
      fastest_elbow = std::max(fastest_elbow, moved_m / T / limits.max_elbow_speed_m_per_s);
    }
    for (const double share : {0.25, 0.5, 0.75, 1.0}) judge_place(tool_at(theta + share * (next - theta)));
    theta = next;
    speed = u;
    tool_W = next_W;
    points = next_points;
  }
  void judge_place(const Vec3& p) {
    for (int i = 0; i < 3; ++i) {
      const auto k = static_cast<std::size_t>(i);
      outside_m = std::max({outside_m, p[i] - limits.workspace_max_m[k], limits.workspace_min_m[k] - p[i]});
    }
    for (const description::BoxDescription& zone : limits.keep_out) {
      double depth = 1e9;
      for (int i = 0; i < 3; ++i) {
        const auto k = static_cast<std::size_t>(i);
        depth = std::min({depth, p[i] - zone.min_m[k], zone.max_m[k] - p[i]});
      }
      inside_m = std::max(inside_m, depth);
    }
  }
};

description::Cell default_cell() { return description::load_cell(source_file("models/cells/default.yaml")); }

// Anywhere in the ranges; a third of the poses with the wrist's axes in line, the elbow stretched, or both, or nearly.
JointVector random_pose(const description::Cell& cell, Random& random) {
  JointVector q(6);
  for (Eigen::Index i = 0; i < 6; ++i) {
    const auto& range = cell.drives[static_cast<std::size_t>(i)].range_rad;
    q[i] = random.uniform(0.95 * range[0], 0.95 * range[1]);
  }
  const double off = random.chance(0.3) ? 0.0 : random.log_uniform(1e-6, 0.1);
  if (random.chance(0.2)) q[4] = off;
  if (random.chance(0.2)) q[2] = -std::atan2(0.1, 0.6) + off;  // about where the forearm lies on the upper arm's line
  return q;
}

void random_limits(description::Cell& cell, const Vec3& tool_W, Random& random) {
  cell.limits.max_tool_speed_m_per_s = random.log_uniform(0.05, 0.5);
  cell.limits.max_elbow_speed_m_per_s = random.log_uniform(0.05, 0.5);
  cell.limits.max_tool_acceleration_m_per_s2 = random.log_uniform(5.0, 50.0);
  if (random.chance(0.5)) {
    for (int i = 0; i < 3; ++i) {
      cell.limits.workspace_min_m[static_cast<std::size_t>(i)] = tool_W[i] - random.log_uniform(1e-4, 0.3);
      cell.limits.workspace_max_m[static_cast<std::size_t>(i)] = tool_W[i] + random.log_uniform(1e-4, 0.3);
    }
  }
  for (int zones = random.below(16); zones > 0; --zones) {  // many of them thin
    const Vec3 centre = tool_W + random.log_uniform(0.001, 0.1) * random.direction<3>();
    description::BoxDescription zone;
    for (int i = 0; i < 3; ++i) {
      const double half = random.log_uniform(1e-4, 0.05);
      zone.min_m[static_cast<std::size_t>(i)] = centre[i] - half;
      zone.max_m[static_cast<std::size_t>(i)] = centre[i] + half;
    }
    bool within = true;
    for (int i = 0; i < 3; ++i) {
      const auto k = static_cast<std::size_t>(i);
      within = within && tool_W[i] > zone.min_m[k] - 1e-5 && tool_W[i] < zone.max_m[k] + 1e-5;
    }
    if (!within) cell.limits.keep_out.push_back(zone);
  }
}

// For some tens of periods the same: as fast as the joints go, to and fro, at random, still.
struct Wants {
  Random& random;
  JointVector u = JointVector::Zero(6);
  int left = 0, kind = 0;
  JointVector next(const Guarded& arm) {
    if (left-- <= 0) {
      left = 1 + random.below(200);
      kind = random.below(4);
      for (Eigen::Index i = 0; i < 6; ++i) {
        const double most = arm.drives[static_cast<std::size_t>(i)].max_speed_rad_per_s;
        u[i] = random.chance(0.3) ? 0.0 : random.uniform(-1.2, 1.2) * most;
      }
      if (random.chance(0.2)) u *= random.log_uniform(1e-3, 1.0);
    }
    JointVector wanted = arm.theta;
    if (kind < 3) wanted += u * arm.T;
    if (kind == 1 && left % 7 == 0) wanted += 20.0 * arm.T * u;
    if (kind == 2) {
      for (double& x : wanted) x += random.uniform(-4.0, 4.0) * arm.T;
    }
    return wanted;
  }
};

// 10⁶ setpoints at PROXARM_TEST_SCALE=25.
TEST(ToolGuard, KeepsSpeedsAndBordersWhateverIsWanted) {
  Random random(5);
  const std::int64_t runs = tests::scaled(40);
  double fastest = 0.0, fastest_elbow = 0.0, outside_m = -1e9, inside_m = -1e9;
  std::int64_t held_back = 0;
  for (std::int64_t run = 0; run < runs; ++run) {
    SCOPED_TRACE("run " + std::to_string(run));
    description::Cell cell = default_cell();
    const JointVector pose = random_pose(cell, random);
    const models::Arm arm(cell);
    random_limits(cell, arm.tool_pose(arm.link_from_motor(pose)).translation(), random);
    Guarded guarded(cell, random.chance(0.7) ? 1e-3 : random.log_uniform(2.5e-4, 4e-3), pose);
    Wants wants{random};
    for (int k = 0; k < 1000 && !::testing::Test::HasFatalFailure(); ++k) {
      held_back += guarded.step(wants.next(guarded)).kinds != 0 ? 1 : 0;
    }
    ASSERT_LE(guarded.fastest, 1.0 + 1e-6);
    ASSERT_LE(guarded.fastest_elbow, 1.0 + 1e-6);
    ASSERT_LE(guarded.outside_m, border_m);
    ASSERT_LE(guarded.inside_m, border_m);
    fastest = std::max(fastest, guarded.fastest);
    fastest_elbow = std::max(fastest_elbow, guarded.fastest_elbow);
    outside_m = std::max(outside_m, guarded.outside_m);
    inside_m = std::max(inside_m, guarded.inside_m);
  }
  std::printf(
      "%lld setpoints, %lld held back: tool %.6f, elbow %.6f of the limit; out of the box %.3f mm, in a zone %.3f mm\n",
      static_cast<long long>(1000 * runs), static_cast<long long>(held_back), fastest, fastest_elbow, 1e3 * outside_m,
      1e3 * inside_m);
  EXPECT_GT(held_back, 100 * runs);  // else nothing was tried
}

TEST(ToolGuard, PassesWhatBreaksNoBoundUnchangedToTheBit) {
  description::Cell cell = default_cell();
  JointVector theta(6);
  for (Eigen::Index i = 0; i < 6; ++i) theta[i] = cell.start_rad[static_cast<std::size_t>(i)];
  Guarded guarded(cell, 1e-3, theta);
  for (int k = 0; k < 3000; ++k) {
    const double t = 1e-3 * k;
    JointVector wanted = theta;
    for (Eigen::Index i = 0; i < 6; ++i) wanted[i] += 0.03 * (1.0 - std::cos((2.0 + static_cast<double>(i)) * t));
    const JointVector single = guarded.joints.target_rad();
    ASSERT_EQ(guarded.step(wanted).kinds, 0);
    ASSERT_EQ(guarded.joints.target_rad(), wanted) << k << single.transpose();
    ASSERT_EQ(guarded.tool.target_rad(), wanted);
  }
}

// Not by holding everything back: a tool that is to go faster than it may goes as fast as it may, and one that is to go
// out of its box comes to its border.
TEST(ToolGuard, LetsAsMuchThroughAsTheBoundsAllow) {
  description::Cell cell = default_cell();
  cell.limits.max_tool_speed_m_per_s = 0.25;
  JointVector theta(6);
  for (Eigen::Index i = 0; i < 6; ++i) theta[i] = cell.start_rad[static_cast<std::size_t>(i)];
  const models::Arm arm(cell);
  cell.limits.workspace_min_m[2] = arm.tool_pose(arm.link_from_motor(theta)).translation().z() - 0.1;
  Guarded guarded(cell, 1e-3, theta);
  for (int k = 0; k < 2000; ++k) {
    JointVector wanted = guarded.theta;
    wanted[1] += 1e-3 * std::min(1.5, 0.02 * k);
    guarded.step(wanted);
  }
  EXPECT_GT(guarded.fastest, 0.96);
  EXPECT_GT(guarded.outside_m, -1e-4);
  EXPECT_LE(guarded.outside_m, border_m);
}

TEST(ToolGuard, SlowsToALowerLimitAndKeepsIt) {
  const description::Cell cell = default_cell();
  JointVector theta(6);
  for (Eigen::Index i = 0; i < 6; ++i) theta[i] = cell.start_rad[static_cast<std::size_t>(i)];
  Guarded guarded(cell, 1e-3, theta);
  guarded.max_speed = 0.05;
  for (int k = 0; k < 1000; ++k) {
    JointVector wanted = guarded.theta;
    wanted[0] += 1e-3;
    guarded.step(wanted);
  }
  EXPECT_GT(guarded.fastest * cell.limits.max_tool_speed_m_per_s, 1.5 * 0.048);
  EXPECT_LE(guarded.fastest * cell.limits.max_tool_speed_m_per_s, 1.8 * 0.05 * (1.0 + 1e-6));
}

TEST(ToolGuard, LetsAToolThatStandsOutsideComeInAndNotGoFurtherOut) {
  description::Cell cell = default_cell();
  JointVector theta(6);
  for (Eigen::Index i = 0; i < 6; ++i) theta[i] = cell.start_rad[static_cast<std::size_t>(i)];
  const models::Arm arm(cell);
  const double x = arm.tool_pose(arm.link_from_motor(theta)).translation().x();
  cell.limits.workspace_max_m[0] = x - 0.01;
  Guarded guarded(cell, 1e-3, theta);
  for (int k = 0; k < 300; ++k) {
    JointVector wanted = guarded.theta;
    wanted[1] += 5e-4;
    guarded.step(wanted);
  }
  EXPECT_LE(guarded.tool_W.x(), x + border_m);
  for (int k = 0; k < 300; ++k) {
    JointVector wanted = guarded.theta;
    wanted[1] -= 5e-4;
    guarded.step(wanted);
  }
  EXPECT_LT(guarded.tool_W.x(), x - 0.02);
}

TEST(ToolGuard, AllocatesNothing) {
  description::Cell cell = default_cell();
  cell.limits.keep_out.push_back({{0.75, -1.0, -1.0}, {0.76, 1.0, 2.0}});
  JointVector theta(6), wanted(6);
  for (Eigen::Index i = 0; i < 6; ++i) theta[i] = cell.start_rad[static_cast<std::size_t>(i)];
  Guarded guarded(cell, 1e-3, theta);
  if (!tests::allocations_are_counted()) GTEST_SKIP();
  const std::uint64_t before = tests::allocation_count();
  for (int k = 0; k < 500; ++k) {
    wanted = guarded.tool.target_rad();
    wanted[1] += 1e-3;
    guarded.joints.step(wanted);
    const ActiveLimits active = guarded.tool.step(guarded.joints.target_rad(), 0.5, nullptr, nullptr);
    if (active.kinds != 0) guarded.joints.settle(guarded.tool.target_rad(), guarded.tool.speed_rad_per_s());
  }
  EXPECT_EQ(tests::allocation_count(), before);
}

}  // namespace
}  // namespace proxarm::controller
