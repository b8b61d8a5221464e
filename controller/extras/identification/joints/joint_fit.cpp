#include "controller/extras/identification/joints/joint_fit.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "controller/extras/identification/joints/friction_fit.hpp"
#include "controller/extras/identification/joints/gear_fit.hpp"
#include "controller/extras/identification/joints/spectrum.hpp"
#include "controller/extras/identification/tool_fit.hpp"
#include "models/base/text.hpp"

namespace proxarm::identification {
namespace {

using description::rounded_text;
using models::JointVector;
using models::Vec3;

// A value isn't identifiable if half of its interval exceeds this share of the value.
constexpr double most_half_share = 0.5;
// If the arm's model leaves more than this share of the readings unexplained, something else moves the handle.
constexpr double most_left_over = 0.25;
constexpr double most_stale = 0.01;
// Forces in slow motions that may remain unexplained without a hand: share of the tool's weight and inertia, share of
// the zero's drift, number of the noise's standard deviations.
constexpr double share_left = 0.1, drift_left = 0.03, deviations_left = 5.0;
// Start of the search if the cell has no gear stiffness or damping.
constexpr double first_mode_Hz = 40.0, first_damping_ratio = 0.03;

Gears gears_of(const description::Cell& cell, const LinkResponse& response) {
  const auto n = static_cast<Eigen::Index>(cell.drives.size());
  Gears gears{Eigen::VectorXd(n), Eigen::VectorXd(n), Eigen::VectorXd::Ones(n)};
  for (Eigen::Index i = 0; i < n; ++i) {
    const description::DriveDescription& drive = cell.drives[static_cast<std::size_t>(i)];
    const double inertia = response.mass_kg_m2()(i, i), omega = 2.0 * std::numbers::pi * first_mode_Hz;
    const double k = drive.gear_stiffness_Nm_per_rad > 0.0 ? drive.gear_stiffness_Nm_per_rad : inertia * omega * omega;
    const double known = drive.gear_damping_Nms_per_rad.value_or(0.0);
    gears.stiffness_Nm_per_rad[i] = k;
    gears.damping_Nms_per_rad[i] = known > 0.0 ? known : 2.0 * first_damping_ratio * std::sqrt(k * inertia);
  }
  return gears;
}

JointVector mean_pose(const std::vector<MotionRecord>& records) {
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(records.front().motor_rad.cols());
  for (const MotionRecord& record : records) sum += record.motor_rad.colwise().mean().transpose();
  return sum / static_cast<double>(records.size());
}

std::vector<MotionRecord> fast_of(const std::vector<MotionRecord>& records) {
  std::vector<MotionRecord> fast;
  for (const MotionRecord& record : records) {
    if (record.motion.fast) fast.push_back(record);
  }
  return fast;
}

Estimate judged(double value, double half, const std::string& hidden_by) {
  Estimate estimate;
  estimate.value = value;
  estimate.half = half;
  estimate.found = std::isfinite(half) && half <= most_half_share * std::abs(value) && value > 0.0;
  if (!estimate.found) estimate.reason = hidden_by;
  return estimate;
}

Estimate not_shown(const std::string& reason) {
  Estimate estimate;
  estimate.reason = reason;
  return estimate;
}

class JointsProblem {
 public:
  JointsProblem(const description::Cell& cell, const std::vector<MotionRecord>& records, const Allowed& allowed)
      : cell_(cell),
        records_(records),
        allowed_(allowed),
        arm_(cell),
        pose_(mean_pose(records)),
        response_(cell, arm_, pose_),
        heavier_(cell, arm_, pose_, 1.0 + allowed.link_inertia) {}

  JointsFit fit() {
    JointsFit fit;
    fit.doubt = touched();
    const std::vector<GearLine> lines = gear_lines(fast_of(records_), allowed_.line);
    start_ = {.gears = gears_of(cell_, response_),
              .sensor_bandwidth_Hz = cell_.sensor.bandwidth_Hz,
              .sensor_scale = allowed_.sensor_scale,
              .link_inertia = allowed_.link_inertia};
    const bool is_shown = cell_.tool.mass_kg > 0.0;
    if (is_shown) found_ = fit_gears(response_, lines, start_);
    gears_ = is_shown ? found_.gears : start_.gears;
    fit.left_over_share = found_.left_over_share;
    if (fit.doubt.empty() && is_shown && fit.left_over_share > most_left_over) {
      fit.doubt =
          "the sensor reads swings that this arm doesn't explain: " + rounded_text(100.0 * fit.left_over_share) +
          " % of them remain; was a hand at the handle, or is the cell's tool or its URDF wrong?";
    }
    for (int joint = 0; joint < arm_.axes(); ++joint) fit.joints.push_back(estimates(joint, is_shown));
    return fit;
  }

 private:
  [[nodiscard]] const MotionRecord& record(int joint, bool fast) const {
    return records_[static_cast<std::size_t>(2 * joint + (fast ? 1 : 0))];
  }

  [[nodiscard]] JointEstimates estimates(int joint, bool gears_are_shown) const {
    JointEstimates e;
    if (gears_are_shown) {
      e.stiffness_Nm_per_rad = gear(found_.gears.stiffness_Nm_per_rad[joint], found_.stiffness_deviation[joint]);
      e.damping_Nms_per_rad = gear(found_.gears.damping_Nms_per_rad[joint], found_.damping_deviation[joint]);
    } else {
      e.stiffness_Nm_per_rad = e.damping_Nms_per_rad =
          not_shown("nothing hangs behind the sensor, whose weight would show how the links swing");
    }
    find_friction(joint, e);
    return e;
  }

  // An error of the links that S doesn't model changes k by about the same share as it changes the links' inertia.
  [[nodiscard]] Estimate gear(double value, double deviation_of_log) const {
    return judged(value, deviations_of_95 * value * std::hypot(deviation_of_log, allowed_.link_inertia),
                  "the tool hardly swings by it up to 40 Hz: its link is too light or its gear too stiff, or the "
                  "sensor's noise hides it");
  }

  void find_friction(int joint, JointEstimates& e) const {
    const description::DriveDescription& drive = cell_.drives[static_cast<std::size_t>(joint)];
    const MotionRecord& fast = record(joint, true);
    const bool is_told =
        fast.torque_share.col(joint).allFinite() && record(joint, false).torque_share.col(joint).allFinite();
    std::string reason;
    if (!(drive.rated_torque_Nm > 0.0)) {
      reason = "the cell doesn't say rated_torque_Nm, what 1000 in 6077h is at the joint";
    } else if (!is_told) {
      reason = "the drive doesn't tell its torque (6077h)";
    }
    if (!reason.empty()) {
      e.coulomb_Nm = e.viscous_Nms_per_rad = e.rotor_inertia_kg_m2 = not_shown(reason);
      return;
    }
    const auto [value, deviation] = friction(joint, drive);
    const char* hidden_by = "the torque's noise, its steps and what else moves hide it";
    e.rotor_inertia_kg_m2 = judged(value[0], deviations_of_95 * deviation[0], hidden_by);
    e.coulomb_Nm = judged(value[1], deviations_of_95 * deviation[1], hidden_by);
    e.viscous_Nms_per_rad = judged(value[2], deviations_of_95 * deviation[2], hidden_by);
  }

  // Returns the friction. The deviations include the errors of the links, of the torque's scale and of the joint's own
  // gear.
  [[nodiscard]] FrictionFit friction(int joint, const description::DriveDescription& drive) const {
    FrictionInputs inputs{.slow = record(joint, false),
                          .fast = record(joint, true),
                          .rated_torque_Nm = drive.rated_torque_Nm,
                          .torque_step_Nm = 1e-3 * drive.rated_torque_Nm,
                          .encoder_step_rad = 1.0 / std::abs(drive.counts_per_rad()),
                          .line_share = allowed_.torque_line};
    FrictionFit fit = fit_friction(arm_, response_, gears_, inputs);
    Eigen::Vector3d squares = fit.deviation.cwiseAbs2();
    const auto also = [&](const FrictionFit& other) { squares += (other.value - fit.value).cwiseAbs2(); };
    also(fit_friction(arm_, heavier_, gears_, inputs));
    constexpr double most_of_log = 0.5;
    for (const bool stiffness : {true, false}) {
      Gears other = gears_;
      const double by =
          found_.stiffness_deviation.size() == 0
              ? most_of_log
              : std::min(most_of_log, stiffness ? found_.stiffness_deviation[joint] : found_.damping_deviation[joint]);
      (stiffness ? other.stiffness_Nm_per_rad : other.damping_Nms_per_rad)[joint] *= std::exp(by);
      also(fit_friction(arm_, response_, other, inputs));
    }
    squares[0] += std::pow(fit.value[0] * between_setpoints(drive), 2);
    inputs.rated_torque_Nm *= 1.0 + allowed_.torque_scale;
    also(fit_friction(arm_, response_, gears_, inputs));
    fit.deviation = squares.cwiseSqrt();
    return fit;
  }

  // Returns the possible difference between the torque at the setpoints and the mean torque, as a share of J θ̈.
  [[nodiscard]] double between_setpoints(const description::DriveDescription& drive) const {
    const double stiff = 2.0 * std::numbers::pi * drive.position_bandwidth_Hz * records_.front().cycle_s;
    return stiff * stiff / 12.0;
  }

  // Returns why the records are doubtful; empty if they aren't. In slow motions, the sensor reads only the tool's
  // weight and inertia; changes from motion to motion are drift.
  [[nodiscard]] std::string touched() const {
    const Vec3 first_S = records_.front().reading_S.leftCols<3>().colwise().mean();
    for (const MotionRecord& record : records_) {
      const std::string& name = arm_.joint_names()[static_cast<std::size_t>(record.motion.joint)];
      if (record.stale > most_stale * static_cast<double>(record.rows)) {
        return "while " + name + " moved, drives didn't answer in " + std::to_string(record.stale) + " cycles";
      }
      const Vec3 mean_S = record.reading_S.leftCols<3>().colwise().mean();
      if (const double by_N = (mean_S - first_S).norm(); by_N > allowed_.zero_drift_N) {
        return "while " + name + " moved, the sensor read " + rounded_text(by_N) +
               " N more than at first: was a hand at the handle, or does its zero drift by more than "
               "sensor.zero_drift_N?";
      }
      if (record.motion.fast) continue;
      if (const double left_N = unexplained_N(record); left_N > 0.0) {
        return "while " + name + " moved, the sensor read " + rounded_text(left_N) +
               " N that no tool of this weight explains: was a hand at the handle, or is the cell's tool wrong "
               "(proxarm identify finds it)?";
      }
    }
    return "";
  }

  // Returns the size of the slow motion's line that isn't explained; 0 if the model explains the line.
  [[nodiscard]] double unexplained_N(const MotionRecord& record) const {
    const Spectrum motors = spectrum(record.motor_rad, record.rows_per_period, {1});
    const Spectrum sensor = spectrum(record.reading_S, record.rows_per_period, {1});
    const double omega = 2.0 * std::numbers::pi * record.base_Hz();
    const ComplexJoints motor_rad = motors.mean.row(0).transpose();
    const ComplexWrench model = response_.reading(omega, response_.links(gears_of(cell_, response_), omega, motor_rad));
    const ComplexWrench read = sensor.mean.row(0).transpose();
    const double left_N = (read - model).head<3>().norm();
    const double noise_N = std::sqrt(2.0 * sensor.variance.leftCols(3).sum());
    const double most_N =
        share_left * model.head<3>().norm() + drift_left * allowed_.zero_drift_N + deviations_left * noise_N;
    return left_N > most_N ? left_N : 0.0;
  }

  const description::Cell& cell_;
  const std::vector<MotionRecord>& records_;
  const Allowed& allowed_;
  models::Arm arm_;
  JointVector pose_;
  LinkResponse response_, heavier_;
  GearStart start_;
  GearFit found_;
  Gears gears_;
};

}  // namespace

JointsFit identify_joints(const description::Cell& cell, const std::vector<MotionRecord>& records,
                          const Allowed& allowed) {
  return JointsProblem(cell, records, allowed).fit();
}

}  // namespace proxarm::identification
