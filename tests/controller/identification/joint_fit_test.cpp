// The judge is a joint of its own, integrated here in time: it shares no line with the simulated arm or with the fit.
#include "controller/extras/identification/joints/joint_fit.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "controller/extras/proof/proof_session.hpp"
#include "models/base/setup_error.hpp"
#include "tests/allocation_count.hpp"
#include "tests/source_file.hpp"

namespace proxarm::identification {
namespace {

using description::Cell;
using models::JointVector;
using models::Vec3;

constexpr double cycle_s = 1e-3;

// A motor that is led, a spring and a damper, a mass, and a tool at its end that a sensor carries.
struct TrueAxis {
  double rotor = 0.0, coulomb = 0.0, viscous = 0.0, stiffness = 0.0, damping = 0.0, mass = 0.0;
  double rounding = 0.0;      // of the torque
  double hand_N_per_m = 0.0;  // of somebody who holds the handle
  bool tells_torque = true;
};

Cell cell_of_one_axis() {
  Cell cell = description::load_cell(source_file("models/cells/linear.yaml"));
  cell.drives[0].rated_torque_Nm = 1000.0;
  cell.tool.mass_kg = 0.5;
  cell.drives[0].gear_stiffness_Nm_per_rad = 1e5;
  return cell;
}

TrueAxis axis_of(const Cell& cell) {
  const models::Arm arm(cell);
  TrueAxis axis;
  axis.mass = arm.link_mass_matrix(arm.start_rad())(0, 0);
  axis.rotor = 0.8 * axis.mass;
  axis.coulomb = 12.0;
  axis.viscous = 60.0;
  axis.stiffness = axis.mass * std::pow(2.0 * M_PI * 17.0, 2);
  axis.damping = 2.0 * 0.04 * std::sqrt(axis.stiffness * axis.mass);
  axis.rounding = 0.5;
  return axis;
}

// The records that a session would bring home, by steps of a fiftieth of a cycle.
class Recorded {
 public:
  Recorded(const Cell& cell, const TrueAxis& axis) : arm_(cell), exercise_(cell, arm_, cycle_s), axis_(axis) {
    start_rad_ = arm_.motor_from_link(arm_.start_rad());
    exercise_.stations(start_rad_);
    models::ToolKinematics at;
    arm_.kinematics(arm_.start_rad(), at);
    along_S_ = at.X_WS.linear().transpose() * at.J_W.col(0).head<3>();
    tool_kg_ = cell.tool.mass_kg;
    centre_S_ = Vec3(cell.tool.centre_of_mass_S_m.data());
    weight_S_ = at.X_WS.linear().transpose() * (tool_kg_ * Vec3(cell.gravity_W_m_per_s2.data()));
    for (std::size_t n = 0; n < exercise_.records().size(); ++n) records.push_back(recorded(n));
  }
  std::vector<MotionRecord> records;

 private:
  [[nodiscard]] double led(std::size_t n, double t) const { return exercise_.offset_rad(n, t)[0]; }

  MotionRecord recorded(std::size_t n) {
    MotionRecord record = exercise_.records()[n];
    constexpr int parts = 50;
    const double h = cycle_s / parts;
    const auto cycles = static_cast<int>(std::lround(exercise_.lasts_s(n) / cycle_s));
    const int first = static_cast<int>(std::lround(ramp_s / cycle_s)) + record.rows_per_period;
    double x = 0.0, v = 0.0;
    for (int k = 0; k < cycles; ++k) {
      const double t = k * cycle_s;
      const double theta = led(n, t), speed = (led(n, t + h) - led(n, t - h)) / (2.0 * h);
      const double acceleration = (led(n, t + h) - 2.0 * theta + led(n, t - h)) / (h * h);
      const double gear = axis_.stiffness * (theta - x) + axis_.damping * (speed - v);
      const double a = (gear - axis_.hand_N_per_m * x) / axis_.mass;
      if (const int row = k - first; row >= 0 && row < static_cast<int>(record.motor_rad.rows())) {
        const double torque =
            axis_.rotor * acceleration + axis_.viscous * speed + std::copysign(axis_.coulomb, speed) + gear;
        fill(record, row, theta, torque, a, -axis_.hand_N_per_m * x);
      }
      for (int p = 0; p < parts; ++p) {
        const double now = t + p * h;
        const double drive =
            axis_.stiffness * led(n, now) + axis_.damping * (led(n, now + h) - led(n, now - h)) / (2.0 * h);
        v += h * (drive - (axis_.stiffness + axis_.hand_N_per_m) * x - axis_.damping * v) / axis_.mass;
        x += h * v;
      }
    }
    record.rows = static_cast<int>(record.motor_rad.rows());
    return record;
  }
  void fill(MotionRecord& record, int row, double theta, double torque, double a, double hand_N) {
    std::normal_distribution<double> noise_N(0.0, 0.02), noise_Nm(0.0, 0.001), noise_rad(0.0, 2e-8), dither(0.0, 1.0);
    record.motor_rad(row, 0) = start_rad_[0] + theta + noise_rad(chance_);
    const double told = axis_.rounding * std::round((torque + dither(chance_)) / axis_.rounding);
    record.torque_share(row, 0) = axis_.tells_torque ? told / 1000.0 : std::numeric_limits<double>::quiet_NaN();
    const Vec3 tool_S = weight_S_ - tool_kg_ * a * along_S_, force_S = tool_S + hand_N * along_S_;
    const Vec3 torque_S = centre_S_.cross(tool_S);
    for (int i = 0; i < 3; ++i) {
      record.reading_S(row, i) = force_S[i] + 5.0 + noise_N(chance_);
      record.reading_S(row, 3 + i) = torque_S[i] - 0.3 + noise_Nm(chance_);
    }
  }

  models::Arm arm_;
  JointExercise exercise_;
  TrueAxis axis_;
  JointVector start_rad_;
  Vec3 along_S_, weight_S_, centre_S_;
  double tool_kg_ = 0.0;
  std::mt19937 chance_{1};
};

JointsFit fit_of(const Cell& cell, const TrueAxis& axis) {
  return identify_joints(cell, Recorded(cell, axis).records, Allowed{.zero_drift_N = 3.0});
}

void expect_true(const Estimate& estimate, double truth, double widest_share) {
  ASSERT_TRUE(estimate.found) << estimate.reason;
  EXPECT_NEAR(estimate.value, truth, estimate.half);
  EXPECT_LE(estimate.half, widest_share * truth);
}

TEST(JointFit, FindsAnAxisThatTheCellHasOtherwise) {
  Cell cell = cell_of_one_axis();
  const TrueAxis axis = axis_of(cell);
  for (const double share : {0.5, 1.0, 2.0}) {
    SCOPED_TRACE(share);
    cell.drives[0].gear_stiffness_Nm_per_rad = share * axis.stiffness;
    cell.drives[0].gear_damping_Nms_per_rad = axis.damping / share;
    const JointsFit fit = fit_of(cell, axis);
    EXPECT_EQ(fit.doubt, "");
    const JointEstimates& e = fit.joints.front();
    expect_true(e.stiffness_Nm_per_rad, axis.stiffness, 0.15);
    expect_true(e.damping_Nms_per_rad, axis.damping, 0.2);
    expect_true(e.rotor_inertia_kg_m2, axis.rotor, 0.4);
    expect_true(e.coulomb_Nm, axis.coulomb, 0.1);
    expect_true(e.viscous_Nms_per_rad, axis.viscous, 0.5);
  }
}

TEST(JointFit, OfACellWithoutAGearFindsIt) {
  Cell cell = cell_of_one_axis();
  const TrueAxis axis = axis_of(cell);
  cell.drives[0].gear_stiffness_Nm_per_rad = 0.0;
  cell.drives[0].gear_damping_Nms_per_rad.reset();
  const JointsFit fit = fit_of(cell, axis);
  const Estimate& stiffness = fit.joints.front().stiffness_Nm_per_rad;
  expect_true(stiffness, axis.stiffness, 0.15);
}

TEST(JointFit, WithoutATorqueSaysThatFrictionIsNotIdentifiable) {
  const Cell cell = cell_of_one_axis();
  TrueAxis axis = axis_of(cell);
  axis.tells_torque = false;
  const JointsFit fit = fit_of(cell, axis);
  EXPECT_FALSE(fit.joints.front().coulomb_Nm.found);
  EXPECT_FALSE(fit.joints.front().rotor_inertia_kg_m2.found);
  EXPECT_NE(fit.joints.front().viscous_Nms_per_rad.reason.find("6077h"), std::string::npos);
  EXPECT_TRUE(fit.joints.front().stiffness_Nm_per_rad.found) << "the sensor shows it all the same";
}

TEST(JointFit, WithoutARatedTorqueSaysWhichKeyIsMissing) {
  Cell cell = cell_of_one_axis();
  const TrueAxis axis = axis_of(cell);
  cell.drives[0].rated_torque_Nm = 0.0;
  EXPECT_NE(fit_of(cell, axis).joints.front().coulomb_Nm.reason.find("rated_torque_Nm"), std::string::npos);
}

TEST(JointFit, WithoutAToolSaysThatGearsAreNotIdentifiable) {
  Cell cell = cell_of_one_axis();
  cell.tool.mass_kg = 0.0;
  const JointsFit fit = fit_of(cell, axis_of(cell));
  EXPECT_FALSE(fit.joints.front().stiffness_Nm_per_rad.found);
  EXPECT_NE(fit.joints.front().damping_Nms_per_rad.reason.find("nothing hangs behind"), std::string::npos);
  EXPECT_TRUE(fit.joints.front().coulomb_Nm.found) << fit.joints.front().coulomb_Nm.reason;
}

TEST(JointFit, AGearStifferThanAnyLineShowsIsntGivenAFigure) {
  Cell cell = cell_of_one_axis();
  TrueAxis axis = axis_of(cell);
  axis.stiffness *= std::pow(400.0 / 17.0, 2);
  axis.damping *= 400.0 / 17.0;
  cell.drives[0].gear_stiffness_Nm_per_rad = axis.stiffness;
  cell.drives[0].gear_damping_Nms_per_rad = axis.damping;
  const Estimate stiffness = fit_of(cell, axis).joints.front().stiffness_Nm_per_rad;
  EXPECT_FALSE(stiffness.found) << stiffness.value << " +- " << stiffness.half;
}

TEST(JointFit, AHandAtTheHandleIsADoubt) {
  const Cell cell = cell_of_one_axis();
  TrueAxis axis = axis_of(cell);
  for (const double hand_N_per_m : {30.0, 300.0}) {
    axis.hand_N_per_m = hand_N_per_m;
    EXPECT_NE(fit_of(cell, axis).doubt.find("hand"), std::string::npos) << hand_N_per_m;
  }
}

TEST(JointFit, ATorqueThatComesLateIsNoFriction) {
  const Cell cell = cell_of_one_axis();
  const TrueAxis axis = axis_of(cell);
  std::vector<MotionRecord> records = Recorded(cell, axis).records;
  constexpr Eigen::Index late = 2;  // cycles, within whole periods
  for (MotionRecord& record : records) {
    const Eigen::MatrixXd told = record.torque_share;
    const Eigen::Index rows = told.rows();
    for (Eigen::Index n = 0; n < rows; ++n) record.torque_share.row(n) = told.row((n + rows - late) % rows);
  }
  const JointEstimates e = identify_joints(cell, records, Allowed{.zero_drift_N = 3.0}).joints.front();
  expect_true(e.rotor_inertia_kg_m2, axis.rotor, 0.4);
  expect_true(e.coulomb_Nm, axis.coulomb, 0.15);
}

// ---- motions

TEST(JointMotion, KeepsToItsBoundsInAllCellsThatTakePositions) {
  for (const char* name : {"default", "cobot", "seven", "scara", "gantry", "linear"}) {
    const Cell cell = description::load_cell(source_file("models/cells/" + std::string(name) + ".yaml"));
    const models::Arm arm(cell);
    JointExercise exercise(cell, arm, cycle_s);
    const auto stations = exercise.stations(arm.motor_from_link(arm.start_rad()));
    ASSERT_EQ(stations.size(), 2 * static_cast<std::size_t>(arm.axes())) << name;
    models::ToolKinematics at;
    arm.kinematics(arm.start_rad(), at);
    for (std::size_t n = 0; n < stations.size(); ++n) {
      const auto joint = static_cast<Eigen::Index>(n / 2);
      const description::DriveDescription& drive = cell.drives[n / 2];
      double speed = 0.0, acceleration = 0.0;
      for (double t = 0.0; t < exercise.lasts_s(n) + 0.1; t += cycle_s) {
        const double before = exercise.offset_rad(n, t - cycle_s)[joint], now = exercise.offset_rad(n, t)[joint];
        const double after = exercise.offset_rad(n, t + cycle_s)[joint];
        speed = std::max(speed, std::abs(after - now) / cycle_s);
        acceleration = std::max(acceleration, std::abs(after - 2.0 * now + before) / (cycle_s * cycle_s));
      }
      EXPECT_LT(speed, 0.3 * drive.max_speed_rad_per_s) << name << " " << n;
      EXPECT_LT(acceleration, 0.5 * drive.max_acceleration_rad_per_s2) << name << " " << n;
      EXPECT_LT(speed * at.J_W.col(joint).head<3>().norm(), proof::proof_speed_m_per_s) << name << " " << n;
      EXPECT_EQ(exercise.offset_rad(n, exercise.lasts_s(n)).norm(), 0.0) << name;
    }
  }
}

TEST(JointMotion, WithoutRoomIsRefused) {
  Cell cell = description::load_cell(source_file("models/cells/default.yaml"));
  const models::Arm arm(cell);
  const JointVector start_rad = arm.motor_from_link(arm.start_rad());
  Cell narrow = cell;
  narrow.drives[3].range_rad[1] = start_rad[3] + 1e-5;
  EXPECT_THROW(joint_motions(narrow, arm, start_rad, cycle_s), description::SetupError);
  Cell walled = cell;
  walled.limits.workspace_max_m[1] = 0.005;  // axis 1 swings the tool along y by more than that
  EXPECT_THROW(joint_motions(walled, arm, start_rad, cycle_s), description::SetupError);
  EXPECT_NO_THROW(joint_motions(cell, arm, start_rad, cycle_s));
}

TEST(JointMotion, AllocatesNothingInTheCycle) {
  const Cell cell = description::load_cell(source_file("models/cells/default.yaml"));
  const models::Arm arm(cell);
  JointExercise exercise(cell, arm, cycle_s);
  exercise.stations(arm.motor_from_link(arm.start_rad()));
  if (!tests::allocations_are_counted()) GTEST_SKIP();
  const std::uint64_t before = tests::allocation_count();
  double sum = 0.0;
  for (int n = 0; n < 100; ++n) sum += exercise.offset_rad(1, 0.1 * n).sum();
  EXPECT_EQ(tests::allocation_count(), before);
  EXPECT_TRUE(std::isfinite(sum));
}

}  // namespace
}  // namespace proxarm::identification
