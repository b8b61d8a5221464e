#include "controller/extras/identification/identification.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "models/base/text.hpp"

namespace proxarm::identification {
namespace {

using models::JointVector;
using models::Mat3;
using models::Vec3;

constexpr double twist_known_to = 0.2, friction_share = 0.02, linearity = 1e-3, resolution_share = 1e-3;
// Number of rounds. The tool twists the gears by some milliradians; the twist is known to a hundredth after the first
// round, to 1e-4 after the second.
constexpr int rounds = 3;

// The links' angles and the gears' twists in a pose.
struct Stand {
  JointVector link_rad, twist_rad;
};

std::vector<Stand> stands_of(const models::Arm& arm, const std::vector<proof::Reading>& readings) {
  std::vector<Stand> stands;
  for (const proof::Reading& reading : readings) {
    const JointVector link_rad = arm.link_from_motor(reading.motor_rad);
    stands.push_back({link_rad, reading.motor_rad - link_rad});
  }
  return stands;
}

// Computes how much the sensor's tilt may differ from pose to pose. A tilt that is the same in all poses, such as the
// tilt of the axis that carries the arm, counts as a mounting error of the base.
class Tilts {
 public:
  Tilts(const description::Cell& cell, const models::Arm& arm, const std::vector<proof::Reading>& readings,
        const std::vector<Stand>& stands)
      : mean_twist_rad_(JointVector::Zero(arm.axes())), friction_rad_(JointVector::Zero(arm.axes())) {
    for (const Stand& stand : stands) mean_twist_rad_ += stand.twist_rad / static_cast<double>(stands.size());
    for (Eigen::Index joint = 0; joint < arm.axes(); ++joint) {
      turns_.push_back(!arm.slides(static_cast<int>(joint)));
      const description::DriveDescription& drive = cell.drives[static_cast<std::size_t>(joint)];
      const bool moved = std::any_of(readings.begin(), readings.end(), [&](const proof::Reading& reading) {
        return reading.station.motor_rad[joint] != readings.front().station.motor_rad[joint];
      });
      if (!moved || drive.gear_stiffness_Nm_per_rad <= 0.0) continue;
      friction_rad_[joint] = friction_share * drive.max_torque_Nm / drive.gear_stiffness_Nm_per_rad;
    }
  }

  [[nodiscard]] double of(const Stand& stand) const {
    double squares = linearity * linearity;
    for (Eigen::Index joint = 0; joint < mean_twist_rad_.size(); ++joint) {
      if (!turns_[static_cast<std::size_t>(joint)]) continue;
      const double twist_rad = twist_known_to * (stand.twist_rad[joint] - mean_twist_rad_[joint]);
      squares += twist_rad * twist_rad + friction_rad_[joint] * friction_rad_[joint];
    }
    return std::sqrt(squares);
  }

 private:
  JointVector mean_twist_rad_, friction_rad_;
  std::vector<bool> turns_;
};

// Returns the standard deviation of the mean of n samples. It follows from the steps between neighbouring samples, Σ =
// Σ(xᵢ₊₁ − xᵢ)²:
// 1. For white noise σ² = Σ/2(n − 1), and the mean's standard deviation is σ/√n.
// 2. Behind the sensor's low-pass, neighbouring samples are correlated by φ = e^(−2π f T). The steps are then smaller,
//    so σ² = Σ/2(n − 1)(1 − φ), and the mean's standard deviation is σ √((1 + φ)/((1 − φ) n)).
//
// A hand that sways slowly makes small steps, so its motion doesn't count as noise.
double deviation_of_mean(const Vec3& step_squares, const proof::Reading& reading, double bandwidth_Hz) {
  const double n = reading.samples;
  if (n < 2.0) return 0.0;
  const double decay = 2.0 * std::numbers::pi * bandwidth_Hz * reading.lasted_s / n;
  // If the sensor's filter is slower than the whole reading, the n samples count as one.
  const double phi = bandwidth_Hz > 0.0 ? std::exp(-std::max(decay, 1.0 / n)) : 0.0;
  const double variance = step_squares.mean() / (2.0 * (n - 1.0) * (1.0 - phi));
  return std::sqrt(variance * (1.0 + phi) / ((1.0 - phi) * n));
}

std::vector<PoseReading> placed(const description::Cell& cell, const std::vector<proof::Reading>& readings,
                                const Allowances& allowances) {
  const models::Arm arm(cell);
  const std::vector<Stand> stands = stands_of(arm, readings);
  const Tilts tilts(cell, arm, readings, stands);
  std::vector<PoseReading> poses;
  for (std::size_t k = 0; k < readings.size(); ++k) {
    const proof::Reading& reading = readings[k];
    const double bandwidth_Hz = cell.sensor.bandwidth_Hz;
    const double step_N = resolution_share * allowances.zero_drift_N;
    const double noise_N = deviation_of_mean(reading.step_squares_S.force, reading, bandwidth_Hz);
    const double noise_Nm = deviation_of_mean(reading.step_squares_S.torque, reading, bandwidth_Hz);
    poses.push_back({.R_SW = arm.sensor_pose(stands[k].link_rad).linear().transpose(),
                     .mean_S = {reading.force_S, reading.torque_S},
                     .noise_N = std::hypot(noise_N, step_N),
                     .noise_Nm = std::hypot(noise_Nm, lever_m * step_N),
                     .tilt_rad = tilts.of(stands[k]),
                     .time_s = reading.time_s});
  }
  return poses;
}

std::string misfit_text(const Misfit& misfit, const char* unit) {
  return "in pose " + std::to_string(misfit.worst_pose + 1) + " by " + description::rounded_text(misfit.worst) + " " +
         unit + ", where noise and what is allowed for explain " +
         description::rounded_text(deviations_of_95 * misfit.explained) + " " + unit;
}

}  // namespace

Allowances allowances_of(double zero_drift_N) noexcept {
  return {.mounting_rad = mounting_deg * std::numbers::pi / 180.0, .zero_drift_N = zero_drift_N};
}

std::string not_shown(const description::Cell& cell, const models::Arm& arm,
                      const std::vector<proof::Station>& stations, const Allowances& allowances) {
  std::vector<Mat3> R_SW;
  for (const proof::Station& station : stations) {
    R_SW.push_back(arm.sensor_pose(arm.link_from_motor(station.motor_rad)).linear().transpose());
  }
  const Vec3 spreads = spread(R_SW, Vec3(cell.gravity_W_m_per_s2.data()));
  if (!shows_mass(spreads, allowances)) {
    return "mass, centre of mass and zero: no joint of the wrist tilts the sensor, and what hangs there can't be told "
           "from its zero; `proxarm zero` takes the zero with the cell's mass";
  }
  if (shows_centre(spreads, allowances)) return "";
  return "centre of mass and zero of the torque: the wrist turns the weight along one short arc, and the lever along "
         "that arc doesn't show";
}

ToolFit identify_tool(const description::Cell& cell, const std::vector<proof::Reading>& readings,
                      const Allowances& allowances) {
  const Vec3 gravity_W(cell.gravity_W_m_per_s2.data());
  description::Cell with_tool = cell;
  ToolFit fit;
  for (int n = 0; n < rounds; ++n) {
    fit = fit_tool(placed(with_tool, readings, allowances), gravity_W, allowances);
    if (!fit.mass_found) return fit;
    with_tool.tool.mass_kg = std::max(0.0, fit.mass_kg);
    if (!fit.centre_found) continue;
    Eigen::Map<Vec3>(with_tool.tool.centre_of_mass_S_m.data()) = fit.centre_S_m;
  }
  // A tool whose mass may be zero has no centre of mass.
  if (fit.mass_kg <= fit.mass_half_kg) fit.centre_found = false;
  return fit;
}

std::string doubts(const ToolFit& fit, const Allowances& allowances) {
  if (!fit.mass_found) return "";
  constexpr double clearly = 4.0;
  if (fit.turned_rad > clearly * allowances.mounting_rad) {
    return "the sensor seems to be turned by " + description::rounded_text(fit.turned_rad * 180.0 / std::numbers::pi) +
           " degrees against its cell: was a hand at the handle, or is sensor.pose_link or base_W wrong? `proxarm "
           "prove` tells signs, ratios and mounting";
  }
  const bool force = !fit.force.explained_all();
  if (!force && (!fit.centre_found || fit.torque.explained_all())) return "";
  return std::string("no tool at rest reads like that: off ") +
         (force ? misfit_text(fit.force, "N") : misfit_text(fit.torque, "Nm")) +
         "; was a hand at the handle, does something swing there, or does a cable pull?";
}

}  // namespace proxarm::identification
