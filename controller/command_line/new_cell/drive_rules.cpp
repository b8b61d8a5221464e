#include "controller/command_line/new_cell/drive_rules.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "models/arm/arm.hpp"
#include "models/arm/tool_space.hpp"
#include "models/base/setup_error.hpp"

namespace proxarm::command_line {
namespace {

namespace fs = std::filesystem;
using std::numbers::pi;

constexpr int poses = 200;
constexpr double rotor_share = 0.5, least_rotor_share = 0.03;
constexpr double gear_Hz = 25.0, stiffest_gear_Hz = 150.0, least_stiffness_share = 0.1, damping_ratio = 0.05;
constexpr double hand_N = 100.0;
constexpr double fastest_rad_per_s = 4.0, fastest_m_per_s = 1.0, usual_rad_per_s = 2.0, usual_m_per_s = 0.5;

struct Load {
  double mean_inertia = 0.0, most_inertia = 0.0, most_gravity = 0.0;
  double most_lever = 0.0;  // of a force at the tool, m; 1 of a joint that slides
};

std::vector<Load> loads_of(const models::Arm& arm) {
  std::vector<Load> loads(static_cast<std::size_t>(arm.axes()));
  for (int p = 0; p < poses; ++p) {
    const models::JointVector q = models::spread_pose(arm, p);
    const models::JointMatrix M = arm.link_mass_matrix(q);
    const models::JointVector gravity = arm.gravity_torque(q);
    models::ToolKinematics tool;
    arm.kinematics(q, tool);
    for (int i = 0; i < arm.axes(); ++i) {
      Load& load = loads[static_cast<std::size_t>(i)];
      load.mean_inertia += M(i, i) / poses;
      load.most_inertia = std::max(load.most_inertia, M(i, i));
      load.most_lever = std::max(load.most_lever, tool.J_W.col(i).head<3>().norm());
      load.most_gravity = std::max(load.most_gravity, std::abs(gravity[i]));
    }
  }
  return loads;
}

double squared(double x) { return x * x; }

// Two digits are all that a rule of thumb is worth.
double rounded(double x) {
  if (!(x > 0.0)) return 0.0;
  const double unit = std::pow(10.0, std::floor(std::log10(x)) - 1.0);
  return std::round(x / unit) * unit;
}

// What a cell may say of a drive ends somewhere, and arms of kilometres or of a thousand tons are mistakes.
void require_possible(const models::Arm& arm, const description::DriveDescription& drive, const fs::path& urdf) {
  constexpr double most_Nm = 1e6;  // of max_torque_Nm in cell files
  if (drive.max_torque_Nm <= most_Nm) return;
  char found[160];
  std::snprintf(found, sizeof found, "an arm that reaches %.3g m and takes %.3g Nm at joint %.60s",
                arm.path_curvature().maxCoeff(), drive.max_torque_Nm, drive.joint.c_str());
  throw description::SetupError({.file = urdf.string(),
                                 .found = found,
                                 .expected = "at most 1e+06 Nm",
                                 .advice = "a URDF's lengths are in m and its masses in kg; --arm-mass says what the "
                                           "arm weighs where the URDF doesn't"});
}

}  // namespace

void size_drives(description::Cell& cell, const std::vector<ChainJoint>& joints, const fs::path& urdf) {
  const models::Arm arm(cell);
  const std::vector<Load> loads = loads_of(arm);
  double heaviest = 0.0;  // of the joints that turn
  for (std::size_t i = 0; i < joints.size(); ++i) {
    if (!joints[i].slides) heaviest = std::max(heaviest, loads[i].mean_inertia);
  }
  for (std::size_t i = 0; i < joints.size(); ++i) {
    const ChainJoint& joint = joints[i];
    const Load& load = loads[i];
    description::DriveDescription& drive = cell.drives[i];
    const double I = load.mean_inertia, least = joint.slides ? 0.0 : heaviest;
    const double rotor = rotor_share * std::max(I, least_rotor_share * least);
    const double stiffness = std::min(squared(2.0 * pi * gear_Hz) * std::max(I, least_stiffness_share * least),
                                      squared(2.0 * pi * stiffest_gear_Hz) * I);
    const double damping = 2.0 * damping_ratio * std::sqrt(stiffness * I);
    const double usual = joint.slides ? usual_m_per_s : usual_rad_per_s;
    drive.max_speed_rad_per_s =
        std::min(joint.max_speed > 0.0 ? joint.max_speed : usual, joint.slides ? fastest_m_per_s : fastest_rad_per_s);
    drive.max_acceleration_rad_per_s2 = 15.0 * drive.max_speed_rad_per_s;
    const double needed = 1.5 * load.most_gravity +
                          0.7 * (load.most_inertia + rotor) * drive.max_acceleration_rad_per_s2 +
                          hand_N * load.most_lever;
    const bool said = joint.max_effort > 1.3 * load.most_gravity && joint.max_effort < 20.0 * needed;
    drive.max_torque_Nm = rounded(said ? joint.max_effort : needed);
    require_possible(arm, drive, urdf);
    drive.rotor_inertia_kg_m2 = rounded(rotor);
    drive.gear_stiffness_Nm_per_rad = rounded(stiffness);
    drive.gear_damping_Nms_per_rad = rounded(damping);
    drive.simulation.gear_damping_Nms_per_rad = rounded(damping);
    drive.simulation.max_torque_Nm = drive.max_torque_Nm;
    drive.simulation.coulomb_friction_Nm = rounded(0.01 * drive.max_torque_Nm);
    drive.simulation.viscous_friction_Nms_per_rad = rounded(0.008 * drive.max_torque_Nm);
  }
}

}  // namespace proxarm::command_line
