#include "sim/physics/arm_dynamics.hpp"

#include <gtest/gtest.h>
#include <tinyxml2.h>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <chrono>
#include <cmath>
#include <fstream>
#include <iostream>
#include <random>

#include "models/base/setup_error.hpp"
#include "tests/sim/cell/default_cell.hpp"

namespace proxarm::sim {
namespace {

using models::Vec3;

void open_brakes(ArmDynamics& arm) {
  for (std::size_t i = 0; i < arm.axis_count(); ++i) arm.brake(i, false);
}

std::vector<double> static_torques(const ArmDynamics& arm) {
  std::vector<double> torque;
  for (std::size_t i = 0; i < arm.axis_count(); ++i) torque.push_back(arm.static_torque_Nm(i));
  return torque;
}

Vec3 tool_position(const ArmDynamics& arm) { return arm.tool().X_WT.translation(); }

TEST(DefaultArm, WeighsAbout150KgAndFeelsHeavierThan60KgInEveryDirection) {
  tinyxml2::XMLDocument urdf;
  ASSERT_EQ(urdf.LoadFile(source_file("models/arms/arm150.urdf").c_str()), tinyxml2::XML_SUCCESS);
  double mass = 0.0;
  for (auto* link = urdf.RootElement()->FirstChildElement("link"); link; link = link->NextSiblingElement("link"))
    mass += link->FirstChildElement("inertial")->FirstChildElement("mass")->DoubleAttribute("value");
  EXPECT_NEAR(mass, 150.0, 2.0);

  const ArmDynamics arm(default_cell(), 0.0);
  const Eigen::SelfAdjointEigenSolver<models::Mat3> solver(arm.effective_mass_kg());
  std::cout << "effective mass at the tool, start pose: " << solver.eigenvalues().transpose()
            << " kg; along x, y, z of W " << arm.effective_mass_kg().inverse().diagonal().cwiseInverse().transpose()
            << " kg\n";
  EXPECT_GT(solver.eigenvalues().minCoeff(), 60.0);
}

TEST(DefaultArm, StartsWithTheToolWhereTheCellSays) {
  const ArmDynamics arm(default_cell(), 1.0);
  EXPECT_LT((tool_position(arm) - Vec3(0.7, 0.0, 0.6)).norm(), 1e-4);         // as the cell's comment rounds it
  EXPECT_LT((arm.tool().X_WT.linear().col(2) + Vec3::UnitZ()).norm(), 1e-4);  // hangs straight down
}

// Every link's inertia is that of the solids that are drawn: mass and size can't have gone apart.
TEST(DefaultArm, HasInertiasThatSolidBodiesCanHave) {
  tinyxml2::XMLDocument urdf;
  ASSERT_EQ(urdf.LoadFile(source_file("models/arms/arm150.urdf").c_str()), tinyxml2::XML_SUCCESS);
  for (auto* link = urdf.RootElement()->FirstChildElement("link"); link; link = link->NextSiblingElement("link")) {
    const auto* i = link->FirstChildElement("inertial")->FirstChildElement("inertia");
    models::Mat3 I;
    const double xy = i->DoubleAttribute("ixy"), xz = i->DoubleAttribute("ixz"), yz = i->DoubleAttribute("iyz");
    I << i->DoubleAttribute("ixx"), xy, xz, xy, i->DoubleAttribute("iyy"), yz, xz, yz, i->DoubleAttribute("izz");
    const Vec3 principal = Eigen::SelfAdjointEigenSolver<models::Mat3>(I).eigenvalues();
    EXPECT_GT(principal[0], 0.0) << link->Attribute("name");
    EXPECT_GE(principal[0] + principal[1], principal[2]) << link->Attribute("name");
  }
}

TEST(DefaultArm, HasItsFirstModeBetween14And16HzWithLockedMotors) {
  const ArmDynamics arm(default_cell(), 1.0);
  const auto modes = arm.locked_modes_Hz();
  std::cout << "modes with motors locked, start pose:";
  for (const double mode : modes) std::cout << " " << mode;
  std::cout << " Hz\n";
  EXPECT_GE(modes.front(), 14.0);
  EXPECT_LE(modes.front(), 16.0);
}

// The eigenvalues are one thing, what the steps do another: ring the arm sideways and count.
TEST(DefaultArm, RingsSidewaysAtTheFrequencyThatTheEigenvaluesSay) {
  ArmDynamics arm(lossless_cell(), 1.0);  // y is axis 1 alone: the second mode
  const auto modes = arm.locked_modes_Hz();
  const std::vector<double> torque = static_torques(arm);
  const double y0 = tool_position(arm).y();
  std::vector<double> crossings_s;
  double before = 0.0;
  for (int k = 1; k <= 16000; ++k) {
    arm.advance();
    arm.apply(torque, Vec3(0.0, k <= 100 ? 50.0 : 0.0, 0.0));
    const double y = tool_position(arm).y() - y0;
    if (k > 200 && before < 0.0 && y >= 0.0) crossings_s.push_back((k - y / (y - before)) * arm.step_s());
    before = y;
  }
  ASSERT_GT(crossings_s.size(), 10u);
  const double frequency = static_cast<double>(crossings_s.size() - 1) / (crossings_s.back() - crossings_s.front());
  double nearest = 1e9;
  for (const double mode : modes) nearest = std::min(nearest, std::abs(mode - frequency));
  EXPECT_LT(nearest, 0.02 * frequency);  // higher modes shift single crossings
  EXPECT_LT(frequency, 20.0);
}

// Without friction and damping a free arm, thrown by a push, keeps its energy. Symplectic Euler's energy wobbles by
// O(h) but doesn't drift; measured against the kinetic energy at stake.
TEST(ArmDynamics, KeepsTheEnergyOfAFreeArmWithoutLosses) {
  const auto drift = [](double step_s) {
    ArmDynamics arm(lossless_cell(), 1.0, step_s);
    open_brakes(arm);
    const std::vector<double> torque(arm.axis_count(), 0.0);
    const auto total = [&] {
      const Energy e = arm.energy();
      return e.kinetic_J + e.potential_J + e.elastic_J;
    };
    const int steps = static_cast<int>(0.6 / step_s);  // long enough to fall by some 0.2 m
    const double start = total();
    double worst = 0.0, kinetic = 0.0;
    for (int k = 0; k < steps; ++k) {
      arm.advance();
      arm.apply(torque, Vec3::Zero());
      worst = std::max(worst, std::abs(total() - start));
      kinetic = std::max(kinetic, arm.energy().kinetic_J);
    }
    std::cout << "h = " << step_s * 1e6 << " us: energy off by " << worst << " J of " << kinetic << " J kinetic\n";
    EXPECT_GT(kinetic, 50.0);
    return worst / kinetic;
  };
  const double coarse = drift(0.25e-3), fine = drift(0.0625e-3);
  EXPECT_LT(coarse, 2e-3);
  EXPECT_LT(fine, coarse / 3.0);  // order 1: 4, and a little for the start
}

// The statics are right in any pose: with the brakes closed and the torque of gravity in the gears, nothing moves.
TEST(ArmDynamics, StandsStillInStaticEquilibriumInRandomPoses) {
  constexpr unsigned seed = 20260101;
  std::cout << "seed " << seed << "\n";
  std::mt19937 random(seed);
  description::Cell cell = default_cell();
  cell.base_W = {{0.3, -0.2, 0.5}, {0.4, -0.3, 1.1}};  // a tilted base: gravity from the side
  ArmDynamics arm(cell, 1.0);
  for (int n = 0; n < scaled(50); ++n) {
    std::vector<double> pose;
    for (const auto& drive : cell.drives)
      pose.push_back(std::uniform_real_distribution(drive.range_rad[0], drive.range_rad[1])(random));
    arm.reset(pose);
    const auto torque = static_torques(arm);
    const Vec3 start = tool_position(arm);
    open_brakes(arm);
    for (int k = 0; k < 400; ++k) {
      arm.advance();
      arm.apply(torque, Vec3::Zero());
    }
    EXPECT_LT((tool_position(arm) - start).norm(), 1e-12);  // rounding of 0.7 m, a few thousand times over
  }
}

// Gravity's torques by another road: how the potential energy changes with each joint.
TEST(ArmDynamics, AgreesOnGravityWithThePotentialEnergy) {
  const description::Cell cell = default_cell();
  ArmDynamics arm(cell, 1.0);
  std::vector<double> pose{0.4, 0.3, 0.2, -0.7, 0.9, 1.0};
  arm.reset(pose);
  const auto torque = static_torques(arm);
  constexpr double step = 1e-5;  // central difference: error step²·mgl/6 ≈ 1e-8, rounding 1e-13·1e3 J/step ≈ 1e-5
  for (std::size_t i = 0; i < pose.size(); ++i) {
    auto shifted = pose;
    shifted[i] = pose[i] + step;
    arm.reset(shifted);
    const double above = arm.energy().potential_J;
    shifted[i] = pose[i] - step;
    arm.reset(shifted);
    const double below = arm.energy().potential_J;
    EXPECT_NEAR((above - below) / (2.0 * step), torque[i], 1e-5) << "axis " << i + 1;
  }
}

// MuJoCo's own friction loss creeps at 2.25 mrad/s at half the break-away torque; a stuck motor here does not at all.
TEST(ArmDynamics, DoesNotCreepAtHalfTheBreakAwayTorque) {
  const description::Cell cell = default_cell();
  ArmDynamics arm(cell, 1.0);
  open_brakes(arm);
  auto torque = static_torques(arm);
  for (std::size_t i = 0; i < torque.size(); ++i) torque[i] += 0.5 * cell.drives[i].simulation.coulomb_friction_Nm;
  std::vector<double> start;
  for (std::size_t i = 0; i < torque.size(); ++i) start.push_back(arm.motor_angle_rad(i));
  for (int k = 0; k < 8000; ++k) {
    arm.advance();
    arm.apply(torque, Vec3::Zero());
  }
  for (std::size_t i = 0; i < torque.size(); ++i) EXPECT_EQ(arm.motor_angle_rad(i), start[i]) << "axis " << i + 1;
}

TEST(ArmDynamics, BreaksAwayAboveTheCoulombTorque) {
  const description::Cell cell = default_cell();
  for (std::size_t axis = 0; axis < cell.drives.size(); ++axis) {
    ArmDynamics arm(cell, 1.0);
    arm.brake(axis, false);
    auto torque = static_torques(arm);
    torque[axis] += 1.05 * cell.drives[axis].simulation.coulomb_friction_Nm;
    const double start = arm.motor_angle_rad(axis);
    for (int k = 0; k < 400; ++k) {
      arm.advance();
      arm.apply(torque, Vec3::Zero());
    }
    EXPECT_GT(arm.motor_angle_rad(axis), start) << "axis " << axis + 1;
  }
}

TEST(ArmDynamics, KeepsAJammedMotorStillAndLetsItGoAgain) {
  ArmDynamics arm(default_cell(), 1.0);
  open_brakes(arm);
  auto torque = static_torques(arm);
  torque[0] += 1000.0;
  arm.jam(0, true);
  const double start = arm.motor_angle_rad(0);
  const auto run = [&](int steps) {
    for (int k = 0; k < steps; ++k) {
      arm.advance();
      arm.apply(torque, Vec3::Zero());
    }
  };
  run(2000);
  EXPECT_EQ(arm.motor_angle_rad(0), start);
  EXPECT_EQ(arm.motor_speed_rad_per_s(0), 0.0);
  arm.jam(0, false);
  run(100);
  EXPECT_GT(arm.motor_angle_rad(0), start + 1e-4);
}

TEST(ArmDynamics, ReadsTheHandlesWeightAtRestAndAPushAlongItsDirection) {
  const description::Cell cell = default_cell();
  ArmDynamics arm(cell, 1.0);
  const double weight = cell.tool.mass_kg * 9.80665;
  const models::Mat3 R_WS = arm.tool().X_WT.linear();  // the handle isn't turned in S
  const Vec3 weight_S = R_WS.transpose() * Vec3(0.0, 0.0, -weight);
  const Vec3 lever_S(cell.tool.centre_of_mass_S_m.data());
  EXPECT_LT((arm.sensor_wrench_S().force - weight_S).norm(), 1e-9);
  EXPECT_LT((arm.sensor_wrench_S().torque - lever_S.cross(weight_S)).norm(), 1e-9);

  const auto torque = static_torques(arm);
  const Vec3 push_W(8.0, -5.0, 3.0);
  for (int k = 0; k < 8000; ++k) {  // until the ringing is gone
    arm.advance();
    arm.apply(torque, push_W);
  }
  const Vec3 push_S = R_WS.transpose() * push_W;  // the arm bends by 50 µm: 1e-4 rad
  const Vec3 handle_S(cell.tool.handle_S.position_m.data());
  EXPECT_LT((arm.sensor_wrench_S().force - weight_S - push_S).norm(), 1e-3);
  EXPECT_LT((arm.sensor_wrench_S().torque - lever_S.cross(weight_S) - handle_S.cross(push_S)).norm(), 1e-3);
  EXPECT_LT((arm.handle_force_W() - push_W).norm(), 1e-3);
}

// The sensor by another road: momentum. Whatever the arm does, the force on the handle's mass is m (a − g).
TEST(ArmDynamics, ReadsTheInertiaOfHandleAndHand) {
  description::Cell cell = default_cell();
  cell.tool.centre_of_mass_S_m = cell.tool.handle_S.position_m;  // so that T's acceleration is the handle's
  ArmDynamics arm(cell, 1.5);
  open_brakes(arm);
  auto torque = static_torques(arm);
  torque[0] += 700.0;
  torque[1] -= 900.0;
  Vec3 velocity = Vec3::Zero();
  for (int k = 0; k < 400; ++k) {
    arm.advance();
    // a(k−1) is exactly what moved v(k−1) to v(k), up to the turn of the Jacobian within the step
    const Vec3 differenced = (arm.tool().velocity_W - velocity) / arm.step_s();
    if (k > 0) {
      EXPECT_LT((differenced - arm.tool().acceleration_W).norm(), 0.01 + 1e-3 * differenced.norm());
    }
    velocity = arm.tool().velocity_W;
    const Vec3 force_W(4.0, 0.0, -2.0);
    arm.apply(torque, force_W);
    const Vec3 a = arm.tool().acceleration_W, g(0.0, 0.0, -9.80665);
    const Vec3 expected_W = force_W - 1.5 * a + cell.tool.mass_kg * (g - a);
    EXPECT_LT((arm.sensor_wrench_S().force - arm.tool().X_WT.linear().transpose() * expected_W).norm(), 1e-9);
    EXPECT_LT((arm.handle_force_W() - (force_W - 1.5 * a)).norm(), 1e-9);
  }
  EXPECT_GT(velocity.norm(), 0.1);
}

// The step of 0.25 ms against one 16 times finer: pushes that ring all modes of the arm.
TEST(ArmDynamics, MovesTheToolAsASixteenTimesFinerStepDoes) {
  const auto run = [](int finer) {
    ArmDynamics arm(default_cell(), 1.0, 0.25e-3 / finer);
    open_brakes(arm);
    const auto hold = static_torques(arm);
    std::vector<Vec3> path;
    for (int k = 0; k < 4000; ++k) {
      for (int j = 0; j < finer; ++j) {
        arm.advance();
        const double t = 0.25e-3 * k;
        auto torque = hold;
        torque[0] += 150.0 * std::sin(2.0 * M_PI * 3.0 * t);
        torque[1] += 150.0 * std::sin(2.0 * M_PI * 2.0 * t);
        torque[4] += 30.0 * std::sin(2.0 * M_PI * 5.0 * t);
        arm.apply(torque, Vec3(20.0 * std::sin(2.0 * M_PI * 7.0 * t), 0.0, 0.0));
      }
      path.push_back(tool_position(arm));
    }
    return path;
  };
  const auto coarse = run(1), fine = run(16);
  double worst = 0.0, way = 0.0;
  for (std::size_t k = 0; k < coarse.size(); ++k) {
    worst = std::max(worst, (coarse[k] - fine[k]).norm());
    way = std::max(way, (fine[k] - fine[0]).norm());
  }
  std::cout << "tool differs by " << worst * 1e6 << " um on a way of " << way * 1e3 << " mm\n";
  EXPECT_LT(worst, 0.01 * way);
}

TEST(ArmDynamics, TurnsFreelyWithinTheBacklashAndNoFurther) {
  description::Cell cell = default_cell();
  cell.gravity_W_m_per_s2 = {0.0, 0.0, 0.0};
  constexpr double backlash = 1e-3;
  cell.drives[0].simulation.backlash_rad = backlash;
  ArmDynamics arm(cell, 0.0);
  const std::vector<double> torque(arm.axis_count(), 0.0);
  double lowest = 1.0, highest = -1.0;
  bool free_seen = false;
  for (int k = 0; k < 20000; ++k) {
    arm.advance();
    arm.apply(torque, Vec3(0.0, (k / 4000) % 2 == 0 ? 5.0 : -5.0, 0.0));
    const double windup = arm.motor_angle_rad(0) - arm.joint_angle_rad(0);
    lowest = std::min(lowest, windup);
    highest = std::max(highest, windup);
    if (std::abs(windup) < 0.5 * backlash) {
      free_seen = true;
      EXPECT_EQ(arm.gear_torque_Nm(0), 0.0);
    }
    // never pulls: torque and side agree
    EXPECT_GE(arm.gear_torque_Nm(0) * windup, 0.0);
  }
  EXPECT_TRUE(free_seen);
  EXPECT_GT(highest, 0.5 * backlash);
  EXPECT_LT(highest, backlash);  // 5 N · 0.7 m on 115 kNm/rad is 30 µrad; bouncing, several times that
  EXPECT_LT(lowest, -0.5 * backlash);
  EXPECT_GT(lowest, -backlash);
}

// A force that rises and falls slowly, motors locked: where the gear carries nothing, what it is wound up by differs by
// the width of its loop between the two ways.
TEST(ArmDynamics, AGearWithHysteresisHasALoopAsWideAsTheCellSays) {
  description::Cell cell = default_cell();
  cell.gravity_W_m_per_s2 = {0.0, 0.0, 0.0};
  constexpr double width_rad = 0.2e-3;
  cell.drives[0].simulation.gear_hysteresis_rad = width_rad;
  cell.drives[0].simulation.gear_damping_Nms_per_rad = 10.0;  // 0.015 Nm at this pace, of 11 Nm of friction
  ArmDynamics arm(cell, 0.0);
  const std::vector<double> torque(arm.axis_count(), 0.0);
  double up_rad = 0.0, down_rad = 0.0, last_Nm = 0.0, largest_rad = 0.0;
  for (int k = 0; k < 80'000; ++k) {
    arm.advance();
    // 400 N at 0.7 m wind a gear of 115 kNm/rad up by a dozen widths: the loop is closed but for exp(−12).
    arm.apply(torque, Vec3(0.0, 400.0 * std::sin(2.0 * M_PI * 0.1 * k * arm.step_s()), 0.0));
    const double windup_rad = arm.motor_angle_rad(0) - arm.joint_angle_rad(0), now_Nm = arm.gear_torque_Nm(0);
    if (k > 20'000 && last_Nm < 0.0 && now_Nm >= 0.0) up_rad = windup_rad;
    if (k > 20'000 && last_Nm > 0.0 && now_Nm <= 0.0) down_rad = windup_rad;
    last_Nm = now_Nm;
    largest_rad = std::max(largest_rad, windup_rad);
  }
  EXPECT_GT(largest_rad, 10.0 * width_rad);
  EXPECT_NEAR(down_rad - up_rad, width_rad, 0.01 * width_rad);
  EXPECT_NEAR(down_rad + up_rad, 0.0, 0.01 * width_rad);
}

// The ripple is a torque with a potential: a rotor without any other load swings in its valleys, at nNθ = π, with
//   ω² = A n N/J
TEST(ArmDynamics, AMotorWhoseTorqueRipplesSwingsInItsValleys) {
  description::Cell cell = default_cell();
  cell.gravity_W_m_per_s2 = {0.0, 0.0, 0.0};
  description::DriveDescription& drive = cell.drives[0];
  drive.gear_stiffness_Nm_per_rad = 1e-3;  // the rotor by itself
  drive.simulation.gear_damping_Nms_per_rad = drive.simulation.coulomb_friction_Nm =
      drive.simulation.viscous_friction_Nms_per_rad = 0.0;
  drive.simulation.torque_ripple_Nm = 20.0;
  drive.simulation.torque_ripple_per_revolution = 4;
  const double per_rad = 4.0 * drive.gear_ratio, valley_rad = M_PI / per_rad;
  cell.start_rad[0] = 0.98 * valley_rad;
  ArmDynamics arm(cell, 0.0);
  open_brakes(arm);
  const std::vector<double> torque(arm.axis_count(), 0.0);
  int crossings = 0;
  double first_s = 0.0, last_s = 0.0, before_rad = arm.motor_angle_rad(0) - valley_rad;
  for (int k = 1; k <= 20'000; ++k) {
    arm.advance();
    arm.apply(torque, Vec3::Zero());
    const double now_rad = arm.motor_angle_rad(0) - valley_rad;
    EXPECT_LT(std::abs(now_rad), 0.03 * valley_rad);
    if (before_rad < 0.0 && now_rad >= 0.0) {
      last_s = (k - now_rad / (now_rad - before_rad)) * arm.step_s();
      if (crossings++ == 0) first_s = last_s;
    }
    before_rad = now_rad;
  }
  ASSERT_GT(crossings, 3);
  const double expected_Hz = std::sqrt(20.0 * per_rad / drive.rotor_inertia_kg_m2) / (2.0 * M_PI);
  // A swing of 2 % of the way to the top is slower by (0.02 π)²/16, the step's error is (ωh)²/24.
  EXPECT_NEAR((crossings - 1) / (last_s - first_s), expected_Hz, 1e-3 * expected_Hz);
}

TEST(ArmDynamics, StopsAtItsMechanicalEndStop) {
  description::Cell cell = default_cell();
  cell.start_rad[0] = 2.7;
  ArmDynamics arm(cell, 1.0);
  arm.brake(0, false);
  auto torque = static_torques(arm);
  torque[0] += 300.0;
  for (int k = 0; k < 20000; ++k) {  // it bounces a few times
    arm.advance();
    arm.apply(torque, Vec3::Zero());
    ASSERT_LT(arm.joint_angle_rad(0), 2.9 + 0.05 + 0.05);  // 2.9 rad in the URDF, 0.05 margin, and what it bends
  }
  EXPECT_GT(arm.joint_angle_rad(0), 2.9);
  EXPECT_LT(std::abs(arm.joint_speed_rad_per_s(0)), 0.01);
}

TEST(ArmDynamics, TakesAGearWithoutAStiffnessAsRigid) {
  description::Cell cell = default_cell();
  for (auto& drive : cell.drives) drive.gear_stiffness_Nm_per_rad = 0.0;
  const ArmDynamics arm(cell, 1.0);
  EXPECT_GT(arm.locked_modes_Hz().front(), 60.0);
}

// The controller believes the data sheet; the gears need not.
TEST(ArmDynamics, HasTheGearsThatTheCellGivesItRatherThanThoseOfTheDataSheet) {
  description::Cell cell = default_cell();
  const double before = ArmDynamics(cell, 1.0).locked_modes_Hz().front();
  for (auto& drive : cell.drives) drive.simulation.gear_stiffness_ratio = 0.81;
  EXPECT_NEAR(ArmDynamics(cell, 1.0).locked_modes_Hz().front(), 0.9 * before, 1e-9 * before);  // ω ~ √k
}

TEST(ArmDynamics, RefusesAGearTooStiffForItsStep) {
  description::Cell cell = default_cell();
  cell.drives[5].gear_stiffness_Nm_per_rad *= 100.0;
  EXPECT_THROW(ArmDynamics(cell, 1.0), description::SetupError);
}

TEST(ArmDynamics, RefusesWhatItCannotSimulate) {
  const auto message = [](const description::Cell& cell) -> std::string {
    try {
      ArmDynamics arm(cell, 1.0);
    } catch (const description::SetupError& error) {
      return error.what();
    }
    return "nothing thrown";
  };
  description::Cell cell = default_cell();
  cell.drives[2].joint = "axis_7";
  EXPECT_NE(message(cell).find("axis_7"), std::string::npos) << message(cell);
  cell = default_cell();
  cell.drives.pop_back();
  EXPECT_NE(message(cell).find("6 moving joints"), std::string::npos) << message(cell);
  cell = default_cell();
  cell.sensor.link = "no_such_link";
  EXPECT_NE(message(cell).find("no_such_link"), std::string::npos) << message(cell);
  cell = default_cell();
  cell.urdf = "no_such_file.urdf";
  EXPECT_NE(message(cell).find("can't be read"), std::string::npos) << message(cell);

  const std::filesystem::path file = std::filesystem::path(testing::TempDir()) / "proxarm_bad.urdf";
  cell.urdf = file;
  std::ofstream(file) << "<robot name='a'><link name='flange'/>\n<joint name='j'><mimic joint='k'/></joint></robot>";
  EXPECT_NE(message(cell).find("coupled"), std::string::npos) << message(cell);
  std::ofstream(file) << "<robot name='a'><link></robot>";
  EXPECT_NE(message(cell).find("well-formed"), std::string::npos) << message(cell);
  std::ofstream(file) << "<arm/>";
  EXPECT_NE(message(cell).find("<robot>"), std::string::npos) << message(cell);
  std::filesystem::remove(file);
}

TEST(ArmDynamics, GivesTheSameBitsTwice) {
  const auto run = [] {
    ArmDynamics arm(default_cell(), 1.0);
    open_brakes(arm);
    auto torque = static_torques(arm);
    torque[3] += 40.0;
    for (int k = 0; k < 1000; ++k) {
      arm.advance();
      arm.apply(torque, Vec3(5.0, std::sin(0.01 * k), 1.0));
    }
    return tool_position(arm);
  };
  EXPECT_EQ(run(), run());
}

TEST(ArmDynamics, ReportsHowLongAStepTakes) {
  ArmDynamics arm(default_cell(), 1.0);
  open_brakes(arm);
  const auto torque = static_torques(arm);
  constexpr int steps = 40000;
  const auto start = std::chrono::steady_clock::now();
  for (int k = 0; k < steps; ++k) {
    arm.advance();
    arm.apply(torque, Vec3(1.0, 0.0, 0.0));
  }
  const std::chrono::duration<double, std::micro> taken = std::chrono::steady_clock::now() - start;
  std::cout << "a step of the mechanics: " << taken.count() / steps << " us\n";
  EXPECT_TRUE(tool_position(arm).allFinite());
}

}  // namespace
}  // namespace proxarm::sim
