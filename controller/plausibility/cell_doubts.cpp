#include <algorithm>
#include <cmath>
#include <numbers>

#include "controller/plausibility/doubts.hpp"
#include "controller/plausibility/expected.hpp"
#include "models/base/text.hpp"

namespace proxarm::controller {

namespace {

using Lines = std::vector<std::string>;

using std::numbers::pi;
constexpr double arc_minute = units::degree / 60.0;

const Expected pose_position{-100.0, 100.0, "m", {units::mm}};
const Expected pose_angle{-2.0 * pi, 2.0 * pi, "rad", {units::degrees}};
const Expected place_at_the_tool{-1.0, 1.0, "m", {units::mm}};

void judge_pose(const std::string& key, const description::PoseDescription& pose, const Expected& position,
                Lines& lines) {
  for (const double x : pose.position_m) judge(key + ".position_m", x, position, lines);
  for (const double angle : pose.rpy_rad) judge(key + ".rpy_rad", angle, pose_angle, lines);
}

void judge_gravity(const description::Cell& cell, Lines& lines) {
  const std::array<double, 3>& g = cell.gravity_W_m_per_s2;
  const double size = std::hypot(g[0], g[1], g[2]);
  if (size == 0.0) return;  // an arm without gravity, for tests
  const std::string key = "gravity_W_m_per_s2";
  judge(key, size, {9.7, 9.9, "m/s²", {units::gravities, units::mm_per_s2, {"cm/s²", 1e-2}}}, lines);
  if (g[2] > 0.5 * size) {
    lines.push_back(
        key + ": found " + description::rounded_text(g[2]) +
        " m/s² along z, which is up, expected what points down: an arm that hangs from a ceiling is turned by "
        "base_W");
  }
}

// A joint's kind, and the inertia that the joint moves at the start: kg m², or kg for a linear joint.
struct Joint {
  bool slides;
  double inertia;
};

void judge_motion(const std::string& key, const description::DriveDescription& drive, const Joint& joint,
                  Lines& lines) {
  if (joint.slides) {
    const Expected speed{0.002, 10.0, "m/s", {units::mm_per_s, units::m_per_min}};
    judge(key + ".max_speed_rad_per_s", drive.max_speed_rad_per_s, speed, lines);
    const Expected acceleration{0.02, 200.0, "m/s²", {units::mm_per_s2, units::gravities}};
    judge(key + ".max_acceleration_rad_per_s2", drive.max_acceleration_rad_per_s2, acceleration, lines);
    for (const double x : drive.range_rad) judge(key + ".range_rad", x, pose_position, lines);
    return;
  }
  const Expected speed{0.02, 20.0, "rad/s", {units::degrees_per_s, {"revolutions/min", 2.0 * pi / 60.0}}};
  judge(key + ".max_speed_rad_per_s", drive.max_speed_rad_per_s, speed, lines);
  const Expected acceleration{0.2, 500.0, "rad/s²", {{"degrees/s²", units::degree}}};
  judge(key + ".max_acceleration_rad_per_s2", drive.max_acceleration_rad_per_s2, acceleration, lines);
  for (const double angle : drive.range_rad)
    judge(key + ".range_rad", angle, {-40.0, 40.0, "rad", {units::degrees}}, lines);
}

void judge_counts(const std::string& key, const description::DriveDescription& drive, const Joint& joint,
                  Lines& lines) {
  const double counts = drive.counts_per_motor_revolution, ratio = drive.gear_ratio;
  Expected expected{200.0, 1e10, "", {}};
  if (counts >= 8.0 && counts <= 33.0) expected.others.push_back({"bits", std::exp2(counts) / counts});
  judge(key + ".counts_per_motor_revolution", counts, expected, lines);
  if (joint.slides || !(ratio > 0.0)) return;
  const OtherUnit inverted{"revolutions of the joint for one of the motor", 1.0 / (ratio * ratio)};
  judge(key + ".gear_ratio", ratio, {0.5, 5000.0, "", {inverted}}, lines);
}

void judge_gear(const std::string& key, const description::DriveDescription& drive, const Joint& joint, Lines& lines) {
  using description::rounded_text;
  const char* const stiffness_unit = joint.slides ? "N/m" : "Nm/rad";
  if (const double k = drive.gear_stiffness_Nm_per_rad; k > 0.0) {
    const double f_Hz = std::sqrt(k / joint.inertia) / (2.0 * pi);
    const std::vector<OtherUnit> others =
        joint.slides ? std::vector<OtherUnit>{{"N/mm", 1e3}, {"N/µm", 1e6}}
                     : std::vector<OtherUnit>{
                           {"kNm/rad", 1e3}, {"Nm/arcmin", 1.0 / arc_minute}, {"Nm/degree", 1.0 / units::degree}};
    judge(key + ".gear_stiffness_Nm_per_rad", k,
          {stiffness_unit, f_Hz, 0.5, "with which what is behind it swings at " + rounded_text(f_Hz) + " Hz"},
          {2.0, 1000.0, "Hz", others}, lines);
  }
  const double ratio = drive.gear_ratio, rotor = drive.rotor_inertia_kg_m2;
  if (rotor > 0.0 && ratio >= 5.0 && !joint.slides) {
    const double share = rotor / joint.inertia;
    judge(key + ".rotor_inertia_kg_m2", rotor, {"kg m²", share, 1.0, rounded_text(share) + " of what the joint moves"},
          {5e-4, 1e5, "", {{"the motor's own, before the gear", ratio * ratio}, units::kg_cm2, units::g_m2}}, lines);
  }
}

void judge_torque(const std::string& key, const description::DriveDescription& drive, const Joint& joint,
                  Lines& lines) {
  const double most = drive.max_torque_Nm;
  if (!(most > 0.0)) return;
  const double needed = (joint.inertia + drive.rotor_inertia_kg_m2) * drive.max_acceleration_rad_per_s2;
  const std::vector<OtherUnit> others =
      joint.slides ? std::vector<OtherUnit>{units::kN} : std::vector<OtherUnit>{units::kNm, {"Nmm", 1e-3}};
  const double share = most / needed;
  judge(key + ".max_torque_Nm", most,
        {joint.slides ? "N" : "Nm", share, 1.0,
         description::rounded_text(share) + " of what moves arm and rotor at max_acceleration_rad_per_s2"},
        {0.02, 2000.0, "", others}, lines);
  const double friction = drive.simulation.coulomb_friction_Nm;
  judge(key + ".simulation.coulomb_friction_Nm", friction / most, {0.0, 1.0, "of max_torque_Nm", {}}, lines);
}

void judge_drives(const description::Cell& cell, const models::Arm& arm, Lines& lines) {
  const models::JointMatrix M = arm.link_mass_matrix(arm.start_rad());
  for (std::size_t i = 0; i < cell.drives.size(); ++i) {
    const description::DriveDescription& drive = cell.drives[i];
    const auto k = static_cast<Eigen::Index>(i);
    const std::string key = "drives[" + std::to_string(i) + "]";
    const Joint joint{arm.slides(static_cast<int>(i)), std::max(M(k, k), 1e-6)};
    judge_motion(key, drive, joint, lines);
    judge_counts(key, drive, joint, lines);
    judge_gear(key, drive, joint, lines);
    judge_torque(key, drive, joint, lines);
    const Expected bandwidth{3.0, 1000.0, "Hz", {units::kHz, {"rad/s", 1.0 / (2.0 * pi)}}};
    judge(key + ".position_bandwidth_Hz", drive.position_bandwidth_Hz, bandwidth, lines);
  }
}

void judge_sensor(const description::Cell& cell, Lines& lines) {
  const description::SensorPlacement& sensor = cell.sensor;
  judge_pose("sensor.pose_link", sensor.pose_link, place_at_the_tool, lines);
  judge("sensor.noise_N", sensor.noise_N, {0.0, 0.02 * cell.limits.max_force_N, "N", {units::milli_N}}, lines);
  judge("sensor.noise_Nm", sensor.noise_Nm, {0.0, 1.0, "Nm", {{"mNm", 1e-3}}}, lines);
  judge("sensor.zero_drift_N", sensor.zero_drift_N, {0.0, 0.5 * cell.limits.max_force_N, "N", {units::milli_N}}, lines);
  if (sensor.sample_rate_Hz > 0.0) {
    judge("sensor.sample_rate_Hz", sensor.sample_rate_Hz, {50.0, 1e6, "Hz", {units::kHz}}, lines);
  }
  if (sensor.bandwidth_Hz > 0.0)
    judge("sensor.bandwidth_Hz", sensor.bandwidth_Hz, {5.0, 1e6, "Hz", {units::kHz}}, lines);
  judge("sensor.delay_s", sensor.delay_s, {0.0, 0.03, "s", {units::ms, {"µs", 1e-6}}}, lines);
}

void judge_tool(const description::ToolDescription& tool, Lines& lines) {
  judge("tool.mass_kg", tool.mass_kg, {0.0, 100.0, "kg", {units::g}}, lines);
  for (const double x : tool.centre_of_mass_S_m) judge("tool.centre_of_mass_S_m", x, place_at_the_tool, lines);
  judge_pose("tool.handle_S", tool.handle_S, {-3.0, 3.0, "m", {units::mm}}, lines);
  if (!(tool.mass_kg > 0.0)) return;
  const double most = std::max({tool.inertia_kg_m2[0], tool.inertia_kg_m2[1], tool.inertia_kg_m2[2]});
  const double across_m = std::sqrt(most / tool.mass_kg);
  judge("tool.inertia_kg_m2", most,
        {"kg m²", across_m, 0.5, "that of a mass " + description::rounded_text(across_m) + " m from its centre"},
        {0.0, 1.0, "m", {units::kg_cm2, {"kg mm²", 1e-6}, units::g_m2}}, lines);
}

void judge_limits(const description::CellLimits& limits, Lines& lines) {
  const Expected speed{0.01, 3.0, "m/s", {units::mm_per_s, units::m_per_min}};
  judge("limits.max_tool_speed_m_per_s", limits.max_tool_speed_m_per_s, speed, lines);
  judge("limits.max_elbow_speed_m_per_s", limits.max_elbow_speed_m_per_s, speed, lines);
  judge("limits.max_tool_acceleration_m_per_s2", limits.max_tool_acceleration_m_per_s2,
        {0.5, 300.0, "m/s²", {units::mm_per_s2, units::gravities}}, lines);
  judge("limits.max_turning_speed_rad_per_s", limits.max_turning_speed_rad_per_s,
        {0.02, 10.0, "rad/s", {units::degrees_per_s}}, lines);
  judge("limits.max_force_N", limits.max_force_N, {5.0, 3000.0, "N", {units::kN}}, lines);
  if (limits.max_power_W > 0.0)
    judge("limits.max_power_W", limits.max_power_W, {1.0, 5000.0, "W", {{"kW", 1e3}}}, lines);
  judge("limits.leash_m", limits.leash_m, {1e-4, 0.3, "m", {units::mm}}, lines);
  judge("limits.following_error_rad", limits.following_error_rad,
        {1e-5, 0.05, "rad", {units::degrees, {"mrad", 1e-3}, {"counts of a million per turn", 2e-6 * pi}}}, lines);
  if (limits.setpoint_bandwidth_Hz > 0.0) {
    judge("limits.setpoint_bandwidth_Hz", limits.setpoint_bandwidth_Hz, {2.0, 500.0, "Hz", {units::kHz}}, lines);
  }
  for (const double x : limits.workspace_min_m) judge("limits.workspace_m", x, pose_position, lines);
  for (const double x : limits.workspace_max_m) judge("limits.workspace_m", x, pose_position, lines);
  for (const description::BoxDescription& box : limits.keep_out) {
    for (const double x : box.min_m) judge("limits.keep_out_m", x, pose_position, lines);
    for (const double x : box.max_m) judge("limits.keep_out_m", x, pose_position, lines);
  }
}

}  // namespace

std::vector<std::string> cell_doubts(const description::Cell& cell, const models::Arm& arm) {
  Lines lines;
  judge_gravity(cell, lines);
  judge_pose("base_W", cell.base_W, pose_position, lines);
  judge_drives(cell, arm, lines);
  judge_sensor(cell, lines);
  judge_tool(cell.tool, lines);
  judge_limits(cell.limits, lines);
  judge("default_mass_kg", cell.default_mass_kg, {0.02, 500.0, "kg", {units::g}}, lines);
  judge("default_damping_Ns_per_m", cell.default_damping_Ns_per_m, {0.0, 2000.0, "Ns/m", {}}, lines);
  for (std::string& line : lines) line = cell.file.string() + ": " + line;
  return lines;
}

}  // namespace proxarm::controller
