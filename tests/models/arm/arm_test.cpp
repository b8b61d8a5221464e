// The arm against independent oracles: KDL for kinematics and dynamics of the same URDF, read here by hand, and finite
// differences.
#include "models/arm/arm.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tinyxml2.h>

#include <fstream>
#include <kdl/chain.hpp>
#include <kdl/chaindynparam.hpp>
#include <kdl/chainfksolverpos_recursive.hpp>
#include <kdl/chainjnttojacsolver.hpp>
#include <sstream>

#include "models/base/setup_error.hpp"
#include "tests/models/surfaces/random_states.hpp"
#include "tests/source_file.hpp"

namespace proxarm::models {
namespace {

using description::Cell;
using description::SetupError;
using testing::HasSubstr;
using tests::Random;

const std::filesystem::path source_dir = source_file();

std::array<double, 3> three(const char* text) {
  std::array<double, 3> v{};
  if (text != nullptr) std::istringstream(text) >> v[0] >> v[1] >> v[2];
  return v;
}

KDL::Frame frame(const description::PoseDescription& pose) {
  return {KDL::Rotation::RPY(pose.rpy_rad[0], pose.rpy_rad[1], pose.rpy_rad[2]),
          KDL::Vector(pose.position_m[0], pose.position_m[1], pose.position_m[2])};
}

KDL::Frame origin_of(const tinyxml2::XMLElement* element) {
  const auto* origin = element == nullptr ? nullptr : element->FirstChildElement("origin");
  if (origin == nullptr) return KDL::Frame::Identity();
  return frame({.position_m = three(origin->Attribute("xyz")), .rpy_rad = three(origin->Attribute("rpy"))});
}

KDL::RigidBodyInertia inertia_of(tinyxml2::XMLElement* robot, const std::string& name) {
  for (auto* link = robot->FirstChildElement("link"); link != nullptr; link = link->NextSiblingElement("link")) {
    if (link->Attribute("name") != name) continue;
    const auto* inertial = link->FirstChildElement("inertial");
    if (inertial == nullptr) break;
    const auto* i = inertial->FirstChildElement("inertia");
    const KDL::Frame X = origin_of(inertial);
    const KDL::RotationalInertia own(i->DoubleAttribute("ixx"), i->DoubleAttribute("iyy"), i->DoubleAttribute("izz"),
                                     i->DoubleAttribute("ixy"), i->DoubleAttribute("ixz"), i->DoubleAttribute("iyz"));
    return X * KDL::RigidBodyInertia(inertial->FirstChildElement("mass")->DoubleAttribute("value"), KDL::Vector::Zero(),
                                     own);
  }
  return KDL::RigidBodyInertia::Zero();
}

// The same with what is fixed to the link, other than by the chain's own next joint.
KDL::RigidBodyInertia rigid_inertia(tinyxml2::XMLElement* robot, const std::string& name, const std::string& next) {
  KDL::RigidBodyInertia sum = inertia_of(robot, name);
  for (auto* joint = robot->FirstChildElement("joint"); joint != nullptr; joint = joint->NextSiblingElement("joint")) {
    const std::string child = joint->FirstChildElement("child")->Attribute("link");
    if (name != joint->FirstChildElement("parent")->Attribute("link") || child == next) continue;
    sum = sum + origin_of(joint) * rigid_inertia(robot, child, next);
  }
  return sum;
}

// W, the URDF's chain up to the sensor's link, S with the tool's inertia, T.
KDL::Chain kdl_chain(const Cell& cell) {
  tinyxml2::XMLDocument document;
  EXPECT_EQ(document.LoadFile(cell.urdf.c_str()), tinyxml2::XML_SUCCESS);
  auto* robot = document.RootElement();
  std::vector<KDL::Segment> segments;
  std::string next;
  for (std::string link = cell.sensor.link;;) {
    auto* joint = robot->FirstChildElement("joint");
    while (joint != nullptr && link != joint->FirstChildElement("child")->Attribute("link")) {
      joint = joint->NextSiblingElement("joint");
    }
    if (joint == nullptr) break;
    const KDL::Frame F = origin_of(joint);
    const auto* axis_element = joint->FirstChildElement("axis");
    const auto axis = axis_element != nullptr ? three(axis_element->Attribute("xyz")) : std::array<double, 3>{1, 0, 0};
    const bool fixed = std::string(joint->Attribute("type")) == "fixed";
    const KDL::Joint moves(joint->Attribute("name"), F.p, F.M * KDL::Vector(axis[0], axis[1], axis[2]),
                           KDL::Joint::RotAxis);
    segments.insert(segments.begin(), KDL::Segment(link, fixed ? KDL::Joint(KDL::Joint::None) : moves, F,
                                                   rigid_inertia(robot, link, next)));
    next = link;
    link = joint->FirstChildElement("parent")->Attribute("link");
  }
  KDL::Chain chain;
  chain.addSegment(KDL::Segment(KDL::Joint(KDL::Joint::None), frame(cell.base_W)));
  for (const auto& segment : segments) chain.addSegment(segment);
  const auto& t = cell.tool;
  const auto& c = t.centre_of_mass_S_m;
  const auto& i = t.inertia_kg_m2;
  const KDL::RigidBodyInertia tool =
      KDL::Frame(KDL::Vector(c[0], c[1], c[2])) *
      KDL::RigidBodyInertia(t.mass_kg, KDL::Vector::Zero(), KDL::RotationalInertia(i[0], i[1], i[2], i[3], i[4], i[5]));
  chain.addSegment(KDL::Segment(KDL::Joint(KDL::Joint::None), frame(cell.sensor.pose_link), tool));
  chain.addSegment(KDL::Segment(KDL::Joint(KDL::Joint::None), frame(t.handle_S)));
  return chain;
}

// An arm at whose flange nothing is neat: skew axes, a base that stands askew, offsets everywhere.
Cell skew_cell() {
  Cell cell = description::load_cell(source_dir / "models/cells/default.yaml");
  cell.urdf = source_dir / "tests/models/arm/data/skew_arm.urdf";
  cell.base_W = {.position_m = {0.3, -0.7, 0.2}, .rpy_rad = {0.4, -0.3, 1.1}};
  cell.gravity_W_m_per_s2 = {0.5, -1.0, -9.7};
  cell.sensor.link = "flange";
  cell.sensor.pose_link = {.position_m = {0.01, -0.02, 0.03}, .rpy_rad = {0.3, 0.2, -0.7}};
  cell.tool.handle_S = {.position_m = {0.02, 0.05, 0.13}, .rpy_rad = {-0.5, 0.1, 0.9}};
  cell.tool.mass_kg = 1.7;
  cell.tool.centre_of_mass_S_m = {0.01, 0.02, 0.05};
  cell.tool.inertia_kg_m2 = {0.004, 0.005, 0.003, 0.0005, -0.0003, 0.0002};
  for (auto& drive : cell.drives) drive.range_rad = {-2.0, 2.0};
  return cell;
}

Cell default_cell() { return description::load_cell(source_dir / "models/cells/default.yaml"); }

JointVector random_angles(Random& random, const Arm& arm) {
  JointVector q(arm.axes());
  for (int i = 0; i < arm.axes(); ++i) q[i] = random.uniform(arm.lower_rad()[i], arm.upper_rad()[i]);
  return q;
}

KDL::JntArray to_kdl(const JointVector& q) {
  KDL::JntArray array(static_cast<unsigned>(q.size()));
  array.data = q;
  return array;
}

Pose to_pose(const KDL::Frame& f) {
  Pose X = Pose::Identity();
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) X(i, j) = f.M(i, j);
    X(i, 3) = f.p(i);
  }
  return X;
}

class ArmAgainstKdl : public testing::TestWithParam<Cell (*)()> {};
INSTANTIATE_TEST_SUITE_P(Arms, ArmAgainstKdl, testing::Values(&default_cell, &skew_cell));

TEST_P(ArmAgainstKdl, HasTheSamePosesAndJacobian) {
  const Cell cell = GetParam()();
  const Arm arm(cell);
  const KDL::Chain chain = kdl_chain(cell);
  KDL::ChainFkSolverPos_recursive forward(chain);
  KDL::ChainJntToJacSolver jacobian(chain);
  Random random(101);
  ToolKinematics at_q;
  for (auto n = tests::scaled(1e4); n > 0; --n) {
    const JointVector q = random_angles(random, arm);
    arm.kinematics(q, at_q);
    KDL::Frame T, S;
    ASSERT_EQ(forward.JntToCart(to_kdl(q), T), 0);
    ASSERT_EQ(forward.JntToCart(to_kdl(q), S, static_cast<int>(chain.getNrOfSegments()) - 1), 0);
    KDL::Jacobian J(6);
    ASSERT_EQ(jacobian.JntToJac(to_kdl(q), J), 0);
    // 1e-12: two orders above the rounding of a chain of eight products of metre size.
    ASSERT_LT((at_q.X_WT.matrix() - to_pose(T).matrix()).cwiseAbs().maxCoeff(), 1e-12) << q.transpose();
    ASSERT_LT((at_q.X_WS.matrix() - to_pose(S).matrix()).cwiseAbs().maxCoeff(), 1e-12) << q.transpose();
    ASSERT_LT((at_q.J_W - J.data).cwiseAbs().maxCoeff(), 1e-12) << q.transpose();
  }
}

TEST_P(ArmAgainstKdl, HasTheSameMassMatrixAndGravityTorques) {
  const Cell cell = GetParam()();
  const Arm arm(cell);
  const KDL::Chain chain = kdl_chain(cell);
  const auto& g = cell.gravity_W_m_per_s2;
  KDL::ChainDynParam dynamics(chain, KDL::Vector(g[0], g[1], g[2]));
  Random random(102);
  for (auto n = tests::scaled(2000); n > 0; --n) {
    const JointVector q = random_angles(random, arm);
    KDL::JntSpaceInertiaMatrix M(6);
    KDL::JntArray gravity(6);
    ASSERT_EQ(dynamics.JntToMass(to_kdl(q), M), 0);
    ASSERT_EQ(dynamics.JntToGravity(to_kdl(q), gravity), 0);
    // MuJoCo diagonalises the inertias, which reach 5 kg m² here, iteratively and to about 1e-8 of them; gravity knows
    // nothing of inertias, so its 1000 Nm are exact to rounding.
    ASSERT_LT((arm.link_mass_matrix(q) - M.data).cwiseAbs().maxCoeff(), 1e-7) << q.transpose();
    ASSERT_LT((arm.gravity_torque(q) - gravity.data).cwiseAbs().maxCoeff(), 1e-10) << q.transpose();
    JointMatrix rotors = arm.mass_matrix(q) - arm.link_mass_matrix(q);
    for (int i = 0; i < 6; ++i) rotors(i, i) -= cell.drives[static_cast<std::size_t>(i)].rotor_inertia_kg_m2;
    ASSERT_LT(rotors.cwiseAbs().maxCoeff(), 1e-12);
  }
}

TEST(Arm, JacobianIsTheDerivativeOfThePose) {
  const Arm arm(skew_cell());
  Random random(103);
  constexpr double d = 1e-5;  // truncation d²/6, rounding ε/d: both near 2e-11
  ToolKinematics at_q;
  for (auto n = tests::scaled(1000); n > 0; --n) {
    const JointVector q = random_angles(random, arm);
    arm.kinematics(q, at_q);
    for (int i = 0; i < 6; ++i) {
      JointVector before = q, after = q;
      before[i] -= d;
      after[i] += d;
      const Pose X0 = arm.tool_pose(before), X1 = arm.tool_pose(after);
      const Vec3 v = (X1.translation() - X0.translation()) / (2.0 * d);
      const Mat3 W = X1.linear() * X0.linear().transpose();
      const Vec3 w = Vec3(W(2, 1) - W(1, 2), W(0, 2) - W(2, 0), W(1, 0) - W(0, 1)) / (4.0 * d);
      ASSERT_LT((at_q.J_W.col(i).head<3>() - v).norm(), 1e-9);
      ASSERT_LT((at_q.J_W.col(i).tail<3>() - w).norm(), 1e-9);
    }
  }
}

// Each joint turns T about the place where it is.
TEST(Arm, PointsAreThoseOfKinematicsAndGravity) {
  const Cell cell = skew_cell();
  const Arm arm(cell);
  Random random(107);
  ArmPoints at;
  ToolKinematics at_q;
  for (int n = 0; n < 1000; ++n) {
    const JointVector q = random_angles(random, arm);
    arm.points(q, at);
    arm.kinematics(q, at_q);
    ASSERT_LT((at.tool_W - at_q.X_WT.translation()).norm(), 1e-14);
    for (int i = 0; i < 6; ++i) {
      const Vec3 z = at_q.J_W.col(i).tail<3>();
      ASSERT_EQ(at_q.joint_W[static_cast<std::size_t>(i)], at.joint_W[static_cast<std::size_t>(i)]);
      ASSERT_LT((z.cross(at.tool_W - at.joint_W[static_cast<std::size_t>(i)]) - at_q.J_W.col(i).head<3>()).norm(),
                1e-13);
    }
    ASSERT_LT((q + at.twist_rad - arm.motor_from_link(q)).cwiseAbs().maxCoeff(), 1e-15);
  }
  const Arm level(default_cell());  // upper arm upright, forearm level: 0.1 m from axis 1, 0.45 + 0.6 m high
  level.points(JointVector::Zero(6), at);
  EXPECT_LT((at.joint_W[2] - Vec3(0.1, 0.0, 1.05)).norm(), 1e-12);
}

// Second differences along straight lines in the joints, over ±1e-4 s: of 1 m they leave 1e-8 m/s² of rounding.
void expect_paths_bend_no_more(const Arm& arm, std::uint64_t seed) {
  Random random(seed);
  const JointMatrix C = arm.path_curvature();
  constexpr double h = 1e-4;
  std::array<ArmPoints, 3> at;
  double most_share = 0.0;
  for (auto n = tests::scaled(1e4); n > 0; --n) {
    const JointVector q = random_angles(random, arm);
    JointVector u(arm.axes());
    for (double& x : u) x = random.chance(0.3) ? 0.0 : random.uniform(-1.0, 1.0);
    for (int i = 0; i < 3; ++i) arm.points(q + (i - 1) * h * u, at[static_cast<std::size_t>(i)]);
    const double most = u.cwiseAbs().dot(C * u.cwiseAbs());
    const auto bend = [&](const Vec3& a, const Vec3& b, const Vec3& c) { return (a - 2.0 * b + c).norm() / (h * h); };
    const double tool = bend(at[0].tool_W, at[1].tool_W, at[2].tool_W);
    ASSERT_LE(tool, most + 1e-6) << q.transpose() << "\n" << u.transpose();
    most_share = std::max(most_share, most > 0.01 ? tool / most : 0.0);
    for (std::size_t i = 0; i < static_cast<std::size_t>(arm.axes()); ++i) {
      ASSERT_LE(bend(at[0].joint_W[i], at[1].joint_W[i], at[2].joint_W[i]), most + 1e-6) << i;
    }
  }
  EXPECT_GT(most_share, 0.5);  // no empty promise
}

TEST(Arm, PathsBendNoMoreThanTheirBound) {
  expect_paths_bend_no_more(Arm(default_cell()), 108);
  expect_paths_bend_no_more(Arm(skew_cell()), 109);
  expect_paths_bend_no_more(Arm(description::load_cell(source_dir / "models/cells/rail.yaml")), 110);
}

TEST(Arm, GravityTorqueIsTheDerivativeOfPotentialEnergy) {
  const Arm arm(skew_cell());
  Random random(104);
  constexpr double d = 1e-4;  // energies of 1e3 J: rounding 1e-13/d, truncation 1e3 d²/6
  for (auto n = tests::scaled(1000); n > 0; --n) {
    const JointVector q = random_angles(random, arm), torque = arm.gravity_torque(q);
    for (int i = 0; i < 6; ++i) {
      JointVector before = q, after = q;
      before[i] -= d;
      after[i] += d;
      const double slope = (arm.potential_energy(after) - arm.potential_energy(before)) / (2.0 * d);
      ASSERT_NEAR(torque[i], slope, 1e-5);
    }
  }
}

TEST(Arm, HoldingTorqueTakesOffWhatTheHandCarries) {
  // A hand that carries the tool's weight at its centre of mass leaves the arm as if there were no tool.
  Cell cell = default_cell();
  cell.tool.handle_S = {.position_m = cell.tool.centre_of_mass_S_m};
  const Arm arm(cell);
  Cell without = cell;
  without.tool.mass_kg = 0.0;
  const Arm bare(without);
  const Wrench carried{.force = Vec3(0.0, 0.0, 9.80665 * cell.tool.mass_kg)};
  Random random(105);
  for (auto n = tests::scaled(100); n > 0; --n) {
    const JointVector q = random_angles(random, arm);
    EXPECT_LT((arm.holding_torque(q, carried) - bare.gravity_torque(q)).cwiseAbs().maxCoeff(), 1e-10);
  }
}

TEST(Arm, GearDeflectionGoesThereAndBack) {
  const Arm arm(default_cell());
  Random random(106);
  double largest = 0.0;
  for (auto n = tests::scaled(1e4); n > 0; --n) {
    const JointVector q = random_angles(random, arm), motor = arm.motor_from_link(q);
    // 4e-15: a few units in the last place of angles up to 4.7 rad.
    ASSERT_LT((arm.link_from_motor(motor) - q).cwiseAbs().maxCoeff(), 4e-15);
    largest = std::max(largest, (motor - q).cwiseAbs().maxCoeff());
  }
  EXPECT_GT(largest, 1e-4);
  EXPECT_LT(largest, 0.1);
}

TEST(Arm, RigidGearsDontDeflect) {
  Cell cell = default_cell();
  for (auto& drive : cell.drives) drive.gear_stiffness_Nm_per_rad = 0.0;
  const Arm arm(cell);
  EXPECT_EQ(arm.motor_from_link(arm.start_rad()), arm.start_rad());
  EXPECT_EQ(arm.link_from_motor(arm.start_rad()), arm.start_rad());
  EXPECT_EQ(arm.first_elastic_frequency_Hz(arm.start_rad()), std::numeric_limits<double>::infinity());
}

TEST(Arm, DefaultCellIsOfThe150KgClass) {
  const Arm arm(default_cell());
  const TipMass tip = arm.effective_mass_range(arm.start_rad());
  const double f = arm.first_elastic_frequency_Hz(arm.start_rad());
  RecordProperty("min_kg", std::to_string(tip.min_kg));
  RecordProperty("first_mode_Hz", std::to_string(f));
  EXPECT_GT(tip.min_kg, 60.0);
  EXPECT_GE(tip.max_kg, tip.min_kg);
  EXPECT_GE(f, 8.0);
  EXPECT_LE(f, 20.0);
  EXPECT_NEAR(arm.effective_mass(arm.start_rad(), tip.min_direction_W), tip.min_kg, 1e-9 * tip.min_kg);
  EXPECT_NEAR(arm.effective_mass(arm.start_rad(), tip.max_direction_W), tip.max_kg, 1e-9 * tip.max_kg);
  const Pose X_WT = arm.tool_pose(arm.start_rad());
  EXPECT_NEAR(X_WT.translation().x(), 0.7, 1e-3);
  EXPECT_NEAR(X_WT.translation().z(), 0.6, 1e-3);
}

TEST(Arm, OneAxisAgreesWithPaperAndPencil) {
  // A rod of 2 kg with its centre at 0.5 m, turned about y, T at 1 m: gravity torque, inertia, tip mass, first mode.
  Cell cell = default_cell();
  cell.urdf = source_dir / "tests/models/arm/data/pendulum.urdf";
  cell.drives.resize(1);
  cell.drives[0].joint = "hinge";
  cell.drives[0].range_rad = {-3.0, 3.0};
  cell.drives[0].rotor_inertia_kg_m2 = 0.25;
  cell.drives[0].gear_stiffness_Nm_per_rad = 100.0;
  cell.start_rad = {0.0};
  cell.sensor.link = "tip";
  cell.sensor.pose_link = {};
  cell.tool = {};
  const Arm arm(cell);
  JointVector q(1);
  q << 0.0;
  EXPECT_NEAR(arm.gravity_torque(q)[0], -2.0 * 9.80665 * 0.5, 1e-12);  // +y turns x towards −z
  EXPECT_NEAR(arm.link_mass_matrix(q)(0, 0), 0.1 + 2.0 * 0.25, 1e-12);
  EXPECT_NEAR(arm.effective_mass(q, Vec3::UnitZ()), 0.1 + 0.5 + 0.25, 1e-12);
  EXPECT_EQ(arm.effective_mass(q, Vec3::UnitX()), std::numeric_limits<double>::infinity());
  EXPECT_EQ(arm.effective_mass_range(q).max_kg, std::numeric_limits<double>::infinity());
  EXPECT_NEAR(arm.first_elastic_frequency_Hz(q), std::sqrt(100.0 / 0.6) / (2.0 * M_PI), 1e-12);
  EXPECT_NEAR(arm.tool_pose(q).translation().x(), 1.0, 1e-15);
}

TEST(Arm, DrivesMayBeListedInAnyOrder) {
  Cell cell = skew_cell();
  const Arm arm(cell);
  std::swap(cell.drives[0], cell.drives[4]);
  std::swap(cell.drives[1], cell.drives[3]);
  const Arm shuffled(cell);
  const std::array<int, 6> order{4, 3, 2, 1, 0, 5};
  Random random(107);
  const JointVector q = random_angles(random, arm);
  JointVector p(6);
  for (int i = 0; i < 6; ++i) p[i] = q[order[static_cast<std::size_t>(i)]];
  ToolKinematics a, b;
  arm.kinematics(q, a);
  shuffled.kinematics(p, b);
  EXPECT_EQ(a.X_WT.matrix(), b.X_WT.matrix());
  for (int i = 0; i < 6; ++i) {
    const int j = order[static_cast<std::size_t>(i)];
    EXPECT_EQ(a.J_W.col(j), b.J_W.col(i));
    EXPECT_EQ(arm.gravity_torque(q)[j], shuffled.gravity_torque(p)[i]);
    EXPECT_EQ(arm.mass_matrix(q)(j, 5), shuffled.mass_matrix(p)(i, 5));
  }
}

// The recursion against the matrix, on arms that turn and slide. Both round torques of up to 1e4 Nm by some 1e-15 of
// them; the softest gear here has 1e3 Nm/rad.
TEST(ArmThatMoves, HasItsMotorsWhereMassMatrixAndGravitySay) {
  Random random(411);
  for (const char* name : {"default", "rail", "seven", "scara", "gantry", "linear"}) {
    const Arm arm(description::load_cell(source_dir / "models/cells" / (std::string(name) + ".yaml")));
    for (auto n = tests::scaled(200); n > 0; --n) {
      JointVector q(arm.axes()), q_dd(arm.axes());
      for (int i = 0; i < arm.axes(); ++i) {
        q[i] = random.uniform(arm.lower_rad()[i], arm.upper_rad()[i]);
        q_dd[i] = random.uniform(-30.0, 30.0);
      }
      const JointVector torque = arm.link_mass_matrix(q) * q_dd;
      JointVector expected = arm.motor_from_link(q);
      for (int i = 0; i < arm.axes(); ++i) {
        const double k = arm.gear_stiffness_Nm_per_rad()[i];
        if (k > 0.0) expected[i] += torque[i] / k;
      }
      ToolKinematics at_q, alone;
      ASSERT_LT((arm.motor_from_moving_link(q, q_dd, at_q) - expected).cwiseAbs().maxCoeff(), 1e-13) << name;
      arm.kinematics(q, alone);
      ASSERT_TRUE(at_q.q_rad == q && at_q.J_W == alone.J_W && at_q.X_WT.matrix() == alone.X_WT.matrix()) << name;
    }
  }
}

// ---- mistakes -------------------------------------------------------------------------------------------------------

Cell fixed_cell() { return description::load_cell(source_dir / "tests/models/description/data/default.yaml"); }

std::string message(const Cell& cell) {
  try {
    const Arm arm(cell);
  } catch (const SetupError& error) {
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
    return error.what();
  }
  return "no error";
}

std::string read(const std::filesystem::path& file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), {}};
}

// The fixed cell with its URDF changed in one place.
Cell with_urdf(const std::string& from, const std::string& to) {
  Cell cell = fixed_cell();
  std::string text = read(cell.urdf);
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  text.replace(at, from.size(), to);
  const auto* test = testing::UnitTest::GetInstance()->current_test_info();
  cell.urdf = std::filesystem::path(testing::TempDir()) / (std::string("proxarm_") + test->name() + ".urdf");
  std::ofstream(cell.urdf) << text;
  return cell;
}

// The rail of models/cells/rail.yaml slides along y of W. Differences of ±1e-6 leave 1e-12 of curvature and, of figures
// of 1e3, 1e-7 of rounding.
TEST(ArmThatSlides, HasItsDerivatives) {
  const Cell cell = description::load_cell(source_dir / "models/cells/rail.yaml");
  const Arm arm(cell);
  JointVector q = arm.start_rad();
  q[0] = 0.3;
  ToolKinematics at_q;
  arm.kinematics(q, at_q);
  EXPECT_TRUE(at_q.J_W.col(0).isApprox((Vec<6>() << 0, 1, 0, 0, 0, 0).finished(), 1e-12));
  const JointVector torque = arm.gravity_torque(q);
  for (int i = 0; i < arm.axes(); ++i) {
    constexpr double h = 1e-6;
    JointVector before = q, after = q;
    before[i] -= h;
    after[i] += h;
    const Vec3 motion = (arm.tool_pose(after).translation() - arm.tool_pose(before).translation()) / (2.0 * h);
    EXPECT_LT((motion - at_q.J_W.col(i).head<3>()).norm(), 1e-9) << i;
    EXPECT_NEAR((arm.potential_energy(after) - arm.potential_energy(before)) / (2.0 * h), torque[i], 1e-5) << i;
  }
}

// Momentum along y is the rail's row of the mass matrix, and in a gravity of 1 m/s² along −y it is the holding force.
TEST(ArmThatSlides, CarriesAllThatHangsOnIt) {
  Cell cell = description::load_cell(source_dir / "models/cells/rail.yaml");
  cell.gravity_W_m_per_s2 = {0.0, -1.0, 0.0};
  const Arm arm(cell);
  JointVector q = arm.start_rad();
  q[0] = -0.2;
  const JointMatrix M = arm.link_mass_matrix(q);
  const JointVector force = arm.gravity_torque(q);
  EXPECT_TRUE(M.row(0).transpose().isApprox(force, 1e-12)) << M.row(0) << "\n" << force.transpose();
  EXPECT_TRUE(M.isApprox(M.transpose(), 1e-14));
  EXPECT_GT(M(0, 0), 100.0) << "kg";
}

TEST(ArmMistakes, AMissingJointIsNamedWithThoseThatExist) {
  Cell cell = fixed_cell();
  cell.drives[2].joint = "axis3";
  const std::string text = message(cell);
  EXPECT_THAT(text, HasSubstr("default.yaml:"));
  EXPECT_THAT(text,
              HasSubstr("drives[2].joint: found \"axis3\", expected a joint of arm150.urdf: axis_1, axis_2, axis_3"));
  EXPECT_THAT(text, HasSubstr("did you mean \"axis_3\"?"));
}

TEST(ArmMistakes, AJointThatFloatsIsRefused) {
  EXPECT_THAT(
      message(with_urdf("name=\"axis_4\" type=\"revolute\"", "name=\"axis_4\" type=\"planar\"")),
      HasSubstr("drives[3].joint: found \"axis_4\", a planar joint, expected a revolute, continuous or prismatic "
                "joint"));
}

TEST(ArmMistakes, AJointWithoutADriveIsRefused) {
  Cell cell = fixed_cell();
  cell.drives.pop_back();
  cell.start_rad.pop_back();
  EXPECT_THAT(message(cell), HasSubstr("revolute joint \"axis_6\" has no drive in default.yaml; add a drive"));
}

TEST(ArmMistakes, AJointBeyondTheSensorIsRefused) {
  Cell cell = fixed_cell();
  cell.sensor.link = "link_5";
  EXPECT_THAT(message(cell),
              HasSubstr("drives[5].joint: found \"axis_6\", expected a joint between the URDF's root and "
                        "the sensor's link \"link_5\""));
}

TEST(ArmMistakes, AnUnknownSensorLinkIsNamed) {
  Cell cell = fixed_cell();
  cell.sensor.link = "flang";
  EXPECT_THAT(message(cell),
              testing::AllOf(HasSubstr("sensor.link: found \"flang\""), HasSubstr("did you mean \"flange\"?")));
}

TEST(ArmMistakes, MimicIsRefused) {
  EXPECT_THAT(message(with_urdf("<axis xyz=\"0 0 1\"/>", "<axis xyz=\"0 0 1\"/><mimic joint=\"axis_2\"/>")),
              HasSubstr("joint \"axis_1\" has <mimic>, which isn't supported"));
}

TEST(ArmMistakes, ARangeBeyondTheUrdfsIsRefused) {
  Cell cell = fixed_cell();
  cell.drives[0].range_rad[1] = 3.0;
  EXPECT_THAT(message(cell),
              HasSubstr("drives[0].range_rad: found [-2.9, 3], expected a range within the URDF's limits of "
                        "that joint, [-2.9, 2.9] rad"));
}

TEST(ArmMistakes, ALinkWithoutInertiaIsRefused) {
  Cell cell = with_urdf("<mass value=\"7\"/>", "<mass value=\"0\"/>");
  EXPECT_THAT(message(cell), HasSubstr("not a usable URDF"));
}

TEST(ArmMistakes, ALinkThatIsNotThereIsNamed) {
  EXPECT_THAT(message(with_urdf("<parent link=\"link_3\"/>", "<parent link=\"link_33\"/>")),
              HasSubstr("joint \"axis_4\" names link \"link_33\", which isn't in the file"));
}

TEST(ArmMistakes, FilesThatAreNoUrdfAreRefused) {
  Cell cell = fixed_cell();
  cell.urdf = "/nonexistent/arm.urdf";
  EXPECT_THAT(message(cell), HasSubstr("/nonexistent/arm.urdf: no such file"));
  cell.urdf = source_dir;
  EXPECT_THAT(message(cell), HasSubstr("is a folder"));
  EXPECT_THAT(message(with_urdf("<robot name=\"arm150\">", "<robot name=\"arm150\"><link>")), HasSubstr("not XML"));
  EXPECT_THAT(message(with_urdf("<link name=\"flange\">", "<link>")), HasSubstr("<link> has no name"));
}

TEST(ArmMistakes, TruncatedUrdfsNeverCrash) {
  Cell cell = fixed_cell();
  const std::string text = read(cell.urdf);
  cell.urdf = std::filesystem::path(testing::TempDir()) / "proxarm_truncated.urdf";
  Random random(108);
  for (auto n = tests::scaled(100); n > 0; --n) {
    std::string part = text;
    if (random.chance(0.3)) {
      part.resize(static_cast<std::size_t>(random.below(static_cast<int>(text.size()))));
    } else {
      for (int i = random.below(4); i >= 0; --i) {
        part[static_cast<std::size_t>(random.below(static_cast<int>(text.size())))] =
            static_cast<char>(random.below(256));
      }
    }
    std::ofstream(cell.urdf) << part;
    message(cell);  // an error or none
  }
}

}  // namespace
}  // namespace proxarm::models
