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
  const std::string key = "gravity_W_m_per_s2";
  judge(key, size, {9.7, 9.9, "m/s²", {units::gravities, units::mm_per_s2, {"cm/s²", 1e-2}}}, lines);
  if (size > 0.0 && g[2] > -0.9 * size) {
    lines.push_back(
        key + ": found " + description::rounded_text(g[2]) +
        " m/s² along z, which is up, expected what points down: an arm on a wall or a ceiling is turned by base_W");
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
  if (ratio <= 1.0 || ratio > 5000.0) return;  // a direct drive may be slow
  const double rpm = drive.max_speed_rad_per_s * ratio * 60.0 / (2.0 * pi);
  judge(key + ".gear_ratio", ratio,
        {"", rpm, 1.0, "with which the motor turns at most " + description::rounded_text(rpm) + " times a minute"},
        {60.0, 1e5, "", {}}, lines);
}

// Judges a gear's damping by the damping ratio that it gives stiffness and inertia.
void judge_gear_damping(const std::string& key, double damping, double stiffness, const Joint& joint, Lines& lines) {
  if (!(damping > 0.0 && stiffness > 0.0)) return;
  const double ratio = 0.5 * damping / std::sqrt(stiffness * joint.inertia);
  const std::vector<OtherUnit> others =
      joint.slides ? std::vector<OtherUnit>{{"Ns/mm", 1e3}}
                   : std::vector<OtherUnit>{{"kNms/rad", 1e3}, {"Nms/degree", 1.0 / units::degree}};
  judge(key, damping,
        {joint.slides ? "Ns/m" : "Nms/rad", ratio, 1.0,
         description::rounded_text(ratio) + " of what would keep it from swinging"},
        {1e-3, 3.0, "", others}, lines);
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
    judge_gear_damping(key + ".gear_damping_Nms_per_rad", drive.gear_damping_Nms_per_rad.value_or(0.0), k, joint,
                       lines);
  }
  const double ratio = drive.gear_ratio, rotor = drive.rotor_inertia_kg_m2;
  if (rotor > 0.0 && ratio >= 5.0 && !joint.slides) {
    const double share = rotor / joint.inertia;
    judge(key + ".rotor_inertia_kg_m2", rotor, {"kg m²", share, 1.0, rounded_text(share) + " of what the joint moves"},
          {5e-3, 1e5, "", {{"the motor's own, before the gear", ratio * ratio}, units::kg_cm2, units::g_m2}}, lines);
  }
}

// Judges a torque limit by the torque that moves arm and rotor at max_acceleration_rad_per_s2.
void judge_most_torque(const std::string& key, double most, const description::DriveDescription& drive,
                       const Joint& joint, Lines& lines) {
  using description::rounded_text;
  if (!(most > 0.0)) return;
  const double needed = (joint.inertia + drive.rotor_inertia_kg_m2) * drive.max_acceleration_rad_per_s2;
  const std::vector<OtherUnit> others =
      joint.slides ? std::vector<OtherUnit>{units::kN} : std::vector<OtherUnit>{units::kNm, {"Nmm", 1e-3}};
  const double share = most / needed;
  std::string says = rounded_text(share) + " of what moves arm and rotor at max_acceleration_rad_per_s2";
  if (const double rotor = drive.rotor_inertia_kg_m2; rotor > 100.0 * joint.inertia) {
    says += " (nearly all of it the rotor, with a rotor_inertia_kg_m2 of " + rounded_text(rotor) + ")";
  }
  judge(key, most, {joint.slides ? "N" : "Nm", share, 1.0, says}, {0.02, 2000.0, "", others}, lines);
}

void judge_torque(const std::string& key, const description::DriveDescription& drive, const Joint& joint,
                  Lines& lines) {
  judge_most_torque(key + ".max_torque_Nm", drive.max_torque_Nm, drive, joint, lines);
}

// The simulated drive.
void judge_simulation(const std::string& key, const description::DriveDescription& drive, const Joint& joint,
                      Lines& lines) {
  const description::SimulatedDrive& simulation = drive.simulation;
  const double most = simulation.max_torque_Nm;
  judge_most_torque(key + ".max_torque_Nm", most, drive, joint, lines);
  judge_gear_damping(key + ".gear_damping_Nms_per_rad", simulation.gear_damping_Nms_per_rad,
                     drive.gear_stiffness_Nm_per_rad, joint, lines);
  judge(key + ".position_gain_per_s", simulation.position_gain_per_s,
        {2.0, 5000.0, "1/s", {{"1/ms", 1e3}, {"m/min per mm", 1e3 / 60.0}}}, lines);
  judge(key + ".velocity_bandwidth_Hz", simulation.velocity_bandwidth_Hz,
        {3.0, 5000.0, "Hz", {units::kHz, {"rad/s", 1.0 / (2.0 * pi)}}}, lines);
  if (!(most > 0.0)) return;
  const Expected share{0.0, 0.6, "of max_torque_Nm", {}};
  judge(key + ".coulomb_friction_Nm", simulation.coulomb_friction_Nm / most, share, lines);
  const double viscous = simulation.viscous_friction_Nms_per_rad * drive.max_speed_rad_per_s;
  judge(key + ".viscous_friction_Nms_per_rad", viscous / most, {0.0, 1.0, "of max_torque_Nm at full speed", {}}, lines);
}

// A device type whose 0x is missing is read as decimal.
void judge_device_type(const std::string& key, const description::DriveDescription& drive, Lines& lines) {
  constexpr std::uint32_t profile_of_drives = 402;  // in the lower half, by CiA 402
  if (!drive.device_type || (*drive.device_type & 0xFFFFU) == profile_of_drives) return;
  lines.push_back(key + ".device_type: found " + std::to_string(*drive.device_type) +
                  ", expected one of CiA 402, whose hexadecimal digits end in 0192; is its 0x missing?");
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
    judge_simulation(key + ".simulation", drive, joint, lines);
    judge_device_type(key, drive, lines);
    const Expected bandwidth{3.0, 1000.0, "Hz", {units::kHz, {"rad/s", 1.0 / (2.0 * pi)}}};
    judge(key + ".position_bandwidth_Hz", drive.position_bandwidth_Hz, bandwidth, lines);
  }
}

void judge_sensor(const description::Cell& cell, Lines& lines) {
  const description::SensorPlacement& sensor = cell.sensor;
  judge_pose("sensor.pose_link", sensor.pose_link, place_at_the_tool, lines);
  judge("sensor.noise_N", sensor.noise_N, {0.0, 0.02 * cell.limits.max_force_N, "N", {units::milli_N}}, lines);
  judge("sensor.noise_Nm", sensor.noise_Nm, {0.0, 0.002 * cell.limits.max_force_N, "Nm", {{"mNm", 1e-3}}}, lines);
  judge("sensor.zero_drift_N", sensor.zero_drift_N, {0.0, 0.5 * cell.limits.max_force_N, "N", {units::milli_N}}, lines);
  if (sensor.sample_rate_Hz > 0.0) {
    judge("sensor.sample_rate_Hz", sensor.sample_rate_Hz, {50.0, 1e6, "Hz", {units::kHz}}, lines);
  }
  if (sensor.bandwidth_Hz > 0.0)
    judge("sensor.bandwidth_Hz", sensor.bandwidth_Hz, {5.0, 1e6, "Hz", {units::kHz}}, lines);
  judge("sensor.delay_s", sensor.delay_s, {0.0, 0.03, "s", {units::ms, {"µs", 1e-6}}}, lines);
}

// The centre of mass can't be far beyond the handle and the size that the inertia implies.
void judge_centre_of_mass(const description::ToolDescription& tool, double across_m, Lines& lines) {
  const auto length_m = [](const std::array<double, 3>& x) { return std::hypot(x[0], x[1], x[2]); };
  const double far_m = 0.1 + 2.0 * length_m(tool.handle_S.position_m) + 3.0 * across_m;
  const double found_m = length_m(tool.centre_of_mass_S_m);
  if (found_m <= far_m || found_m > 1.0) return;  // beyond 1 m place_at_the_tool reports it
  lines.push_back("tool.centre_of_mass_S_m: found " + description::rounded_text(found_m) +
                  " m from the sensor, expected at most " + description::rounded_text(far_m) +
                  " m beside handle_S and inertia_kg_m2");
}

void judge_tool(const description::ToolDescription& tool, Lines& lines) {
  judge("tool.mass_kg", tool.mass_kg, {0.0, 100.0, "kg", {units::g}}, lines);
  for (const double x : tool.centre_of_mass_S_m) judge("tool.centre_of_mass_S_m", x, place_at_the_tool, lines);
  judge_pose("tool.handle_S", tool.handle_S, {-3.0, 3.0, "m", {units::mm}}, lines);
  const double most = std::max({tool.inertia_kg_m2[0], tool.inertia_kg_m2[1], tool.inertia_kg_m2[2]});
  if (!(tool.mass_kg > 0.0)) {
    if (most > 0.0) lines.push_back("tool.mass_kg: found 0 kg, beside an inertia, expected what the tool weighs");
    return;
  }
  const double across_m = std::sqrt(most / tool.mass_kg);
  // Lower bound: radius of gyration of a solid ball of tungsten.
  const double least_m = 0.6 * std::cbrt(tool.mass_kg / 80000.0);
  if (most > 0.0) {
    judge("tool.inertia_kg_m2", most,
          {"kg m²", across_m, 0.5, "that of a mass " + description::rounded_text(across_m) + " m from its centre"},
          {0.5 * least_m, 1.0, "m", {units::kg_cm2, {"kg mm²", 1e-6}, units::g_m2, {"t m²", 1e3}}}, lines);
  }
  judge_centre_of_mass(tool, across_m, lines);
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
  if (limits.max_turn_rad > 0.0) {
    judge("limits.max_turn_rad", limits.max_turn_rad, {0.01, 3.0, "rad", {}}, lines);
  }
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

std::vector<std::string> register_doubts(const description::ModbusDriveDescription& drive) {
  Lines lines;
  const auto judge_register = [&](const std::string& key, int at) {
    const int first = at > 40000 ? 40001 : 30001;
    if (at < first || at >= first + 9999) return;
    lines.push_back(drive.file.string() + ": " + key + ": found " + std::to_string(at) +
                    ", expected a register as on the wire, where they count from 0; if the manual counts from " +
                    std::to_string(first) + ", write " + std::to_string(at - first));
  };
  judge_register("command.register", drive.command_register);
  judge_register("feedback.register", drive.feedback_register);
  judge_register("feedback.position.register", drive.position.at);
  judge_register("feedback.status.register", drive.status.at);
  for (std::size_t i = 0; i < drive.settings.size(); ++i) {
    judge_register("settings[" + std::to_string(i) + "].register", drive.settings[i].at);
  }
  return lines;
}

}  // namespace proxarm::controller
