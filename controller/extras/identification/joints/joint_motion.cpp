#include "controller/extras/identification/joints/joint_motion.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>

#include "controller/extras/identification/free_path.hpp"
#include "models/base/setup_error.hpp"
#include "models/base/text.hpp"

namespace proxarm::identification {
namespace {

using models::JointVector;

constexpr double pi = std::numbers::pi;
constexpr double slow_tool_m_per_s = 0.06, line_tool_m_per_s2 = 0.25;
constexpr double most_rad = 0.1, least_rad = 1e-4;
constexpr double share_of_speed = 0.2, share_of_torque = 0.2, share_of_acceleration = 0.03, share_of_room = 0.5;
constexpr int first_line = 6, line_step = 3, cycles_per_line = 12;
// Least lever arm that is assumed between a joint and the tool; a shorter one hardly moves the tool.
constexpr double least_lever_m = 1e-3;

int rows_of(double cycle_s) { return static_cast<int>(std::lround(base_period_s / cycle_s)); }

int line_count(int rows_per_period, double cycle_s) noexcept {
  const double base_Hz = 1.0 / (rows_per_period * cycle_s);
  int count = 0;
  for (int h = first_line; h * base_Hz <= highest_line_Hz && h * cycles_per_line <= rows_per_period; h += line_step) {
    ++count;
  }
  return count;
}

double seconds_of(const JointMotion& motion, double cycle_s) {
  return 2.0 * ramp_s + (1 + motion.periods()) * rows_of(cycle_s) * cycle_s;
}

double minimum_jerk(double s) {
  const double x = std::clamp(s, 0.0, 1.0);
  return x * x * x * (10.0 + x * (-15.0 + x * 6.0));
}

// Returns the motion without its ramps.
double wave(const JointMotion& motion, double time_s, double cycle_s) {
  const double base_rad_per_s = 2.0 * pi / (rows_of(cycle_s) * cycle_s);
  if (!motion.fast) return motion.amplitude * std::sin(base_rad_per_s * time_s);
  double sum = 0.0;
  const int count = line_count(rows_of(cycle_s), cycle_s);
  for (int k = 0; k < count; ++k) {
    const double omega = (first_line + k * line_step) * base_rad_per_s;
    sum += motion.amplitude / (omega * omega) * std::cos(omega * time_s - pi * k * k / count);
  }
  return sum;
}

double most_offset(const JointMotion& motion, double cycle_s) {
  double most = 0.0;
  for (int row = 0; row < rows_of(cycle_s); ++row)
    most = std::max(most, std::abs(wave(motion, row * cycle_s, cycle_s)));
  return most;
}

// Returns the smallest amplitude of the bounds in the header.
double amplitude_of(const description::Cell& cell, const models::ToolKinematics& at, int joint, bool fast,
                    double cycle_s) {
  const description::DriveDescription& drive = cell.drives[static_cast<std::size_t>(joint)];
  const double lever_m = std::max(least_lever_m, at.J_W.col(joint).head<3>().norm());
  const double most_Nm = drive.max_torque_Nm > 0.0 ? drive.max_torque_Nm : drive.simulation.max_torque_Nm;
  const double by_torque = share_of_torque * most_Nm / std::max(1e-9, drive.rotor_inertia_kg_m2);
  const int rows = rows_of(cycle_s);
  if (fast) {
    const double lines = line_count(rows, cycle_s);
    const double peak = std::sqrt(2.0 * lines);  // peak of the sum of lines, in amplitudes of one line
    return std::min(
        {share_of_acceleration * drive.max_acceleration_rad_per_s2, line_tool_m_per_s2 / lever_m, by_torque / peak});
  }
  const double omega = 2.0 * pi / (rows * cycle_s);
  return std::min({most_rad, slow_tool_m_per_s / (lever_m * omega), share_of_speed * drive.max_speed_rad_per_s / omega,
                   by_torque / (omega * omega)});
}

// Returns the distance from the joint's angle to the nearer end of the joint's range.
double room_rad(const description::Cell& cell, const models::Arm& arm, const JointVector& motor_rad, int joint) {
  const description::DriveDescription& drive = cell.drives[static_cast<std::size_t>(joint)];
  const double low = std::max(drive.range_rad[0], arm.lower_rad()[joint]);
  const double high = std::min(drive.range_rad[1], arm.upper_rad()[joint]);
  return std::min(motor_rad[joint] - low, high - motor_rad[joint]);
}

[[noreturn]] void refuse(const description::Cell& cell, const models::Arm& arm, int joint, const std::string& found) {
  throw description::SetupError({.file = cell.file.string(),
                                 .key = "identify --joints",
                                 .found = found,
                                 .expected = "room for " + arm.joint_names()[static_cast<std::size_t>(joint)] +
                                             " to move about the pose the arm is in, within its range, workspace_m "
                                             "and keep_out_m",
                                 .advice = "begin further from the border"});
}

void require_free(const description::Cell& cell, const models::Arm& arm, const JointVector& motor_rad,
                  const JointMotion& motion, double cycle_s) {
  const double most = most_offset(motion, cycle_s);
  JointVector low_rad = motor_rad, high_rad = motor_rad;
  low_rad[motion.joint] -= most;
  high_rad[motion.joint] += most;
  if (free_path(cell, arm, low_rad, high_rad)) return;
  refuse(cell, arm, motion.joint, "a motion of " + description::rounded_text(most) + " rad that leaves it");
}

}  // namespace

std::vector<int> fast_lines(int rows_per_period, double cycle_s) {
  std::vector<int> lines;
  const int count = line_count(rows_per_period, cycle_s);
  for (int k = 0; k < count; ++k) lines.push_back(first_line + k * line_step);
  return lines;
}

std::vector<JointMotion> joint_motions(const description::Cell& cell, const models::Arm& arm,
                                       const JointVector& motor_rad, double cycle_s) {
  models::ToolKinematics at;
  arm.kinematics(arm.link_from_motor(motor_rad), at);
  std::vector<JointMotion> motions;
  for (int joint = 0; joint < arm.axes(); ++joint) {
    const double room = share_of_room * room_rad(cell, arm, motor_rad, joint);
    for (const bool fast : {false, true}) {
      JointMotion motion{joint, fast, amplitude_of(cell, at, joint, fast, cycle_s)};
      const double most = most_offset(motion, cycle_s);
      if (most > room) motion.amplitude *= std::max(0.0, room) / most;
      if (!fast && motion.amplitude < least_rad) {
        refuse(cell, arm, joint, description::rounded_text(2.0 * std::max(0.0, room)) + " rad to the end of its range");
      }
      require_free(cell, arm, motor_rad, motion, cycle_s);
      motions.push_back(motion);
    }
  }
  return motions;
}

std::string text(const std::vector<JointMotion>& motions, const models::Arm& arm, double cycle_s) {
  double all_s = 0.0;
  for (const JointMotion& motion : motions) all_s += seconds_of(motion, cycle_s);
  std::array<char, 160> line{};
  std::snprintf(line.data(), line.size(), "the arm is about to move, one joint after the other, for %.0f s:\n", all_s);
  std::string told = line.data();
  for (const JointMotion& motion : motions) {
    if (motion.fast) continue;
    const double fast = motions[static_cast<std::size_t>(&motion - motions.data()) + 1].amplitude;
    const bool slides = arm.slides(motion.joint);
    std::snprintf(line.data(), line.size(),
                  "  %-10s \u00b1 %.3g %s at %.2g Hz, then %.2g %s in each line up to %.0f Hz\n",
                  arm.joint_names()[static_cast<std::size_t>(motion.joint)].c_str(), 1e3 * motion.amplitude,
                  slides ? "mm" : "mrad", 1.0 / (rows_of(cycle_s) * cycle_s), fast,
                  slides ? "m/s\u00b2" : "rad/s\u00b2", highest_line_Hz);
    told += line.data();
  }
  return told;
}

JointExercise::JointExercise(const description::Cell& cell, const models::Arm& arm, double cycle_s)
    : cell_(cell), arm_(arm), cycle_s_(cycle_s) {}

std::vector<proof::Station> JointExercise::stations(const JointVector& motor_rad) {
  const std::vector<JointMotion> motions = joint_motions(cell_, arm_, motor_rad, cycle_s_);
  const int rows = rows_of(cycle_s_);
  records_.clear();
  for (const JointMotion& motion : motions) {
    MotionRecord record;
    record.motion = motion;
    record.rows_per_period = rows;
    record.cycle_s = cycle_s_;
    record.motor_rad = record.torque_share = Eigen::MatrixXd::Zero(rows * motion.periods(), arm_.axes());
    record.reading_S = Eigen::MatrixXd::Zero(rows * motion.periods(), 6);
    records_.push_back(std::move(record));
  }
  return std::vector<proof::Station>(motions.size(), {motor_rad});
}

JointVector JointExercise::offset_rad(std::size_t station, double time_s) const noexcept {
  const JointMotion& motion = records_[station].motion;
  const double left_s = seconds_of(motion, cycle_s_) - time_s;
  const double share = minimum_jerk(time_s / ramp_s) * minimum_jerk(left_s / ramp_s);
  JointVector offset = JointVector::Zero(arm_.axes());
  if (share > 0.0) offset[motion.joint] = share * wave(motion, time_s, cycle_s_);
  return offset;
}

double JointExercise::lasts_s(std::size_t station) const noexcept {
  return seconds_of(records_[station].motion, cycle_s_);
}

void JointExercise::take(std::size_t station, double time_s, const proof::Exercised& cycle) noexcept {
  MotionRecord& record = records_[station];
  const long row = std::lround((time_s - ramp_s) / cycle_s_) - record.rows_per_period;
  if (row < 0 || row >= record.motor_rad.rows()) return;
  const controller::Measured& now = cycle.measured;
  record.motor_rad.row(row) = now.motor_rad.transpose();
  record.reading_S.row(row).head<3>() = now.reading_S.force.transpose();
  record.reading_S.row(row).tail<3>() = now.reading_S.torque.transpose();
  for (std::size_t i = 0; i < cycle.drives.size(); ++i) {
    const auto share = cycle.drives[i].drive.torque_share();
    record.torque_share(row, static_cast<Eigen::Index>(i)) = share.value_or(std::numeric_limits<double>::quiet_NaN());
    if (!cycle.drives[i].drive.fresh()) ++record.stale;
  }
  record.rows = static_cast<int>(row) + 1;
}

}  // namespace proxarm::identification
