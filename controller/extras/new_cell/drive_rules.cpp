#include "controller/extras/new_cell/drive_rules.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <utility>

#include "models/arm/arm.hpp"
#include "models/arm/tool_space.hpp"
#include "models/base/setup_error.hpp"
#include "models/base/text.hpp"

namespace proxarm::command_line {
namespace {

namespace fs = std::filesystem;
using std::numbers::pi;

constexpr int poses = 200;
constexpr double rotor_share = 0.5, least_rotor_share = 0.03;
constexpr double gear_Hz = 25.0, stiffest_gear_Hz = 150.0, least_stiffness_share = 0.1, damping_ratio = 0.05;
constexpr double hand_N = 100.0;
// A tenth of a drive's torque is left for friction and for the motion of other joints. Links may weigh a fifth more
// than the URDF states.
constexpr double torque_share = 0.9, weight_margin = 1.2;
// The largest force at the tool that sensor and handle withstand, and the smallest that the default hands need.
constexpr double most_force_N = 200.0, least_force_N = 60.0;
// Largest acceleration of a joint divided by its largest speed, 1/s: the usual value (full speed in a 15th of a
// second), and the smallest plausible value.
constexpr double usual_per_s = 15.0, least_per_s = 3.0;
constexpr double fastest_rad_per_s = 4.0, fastest_m_per_s = 1.0, usual_rad_per_s = 2.0, usual_m_per_s = 0.5;

struct Load {
  double mean_inertia = 0.0, most_inertia = 0.0, most_gravity = 0.0;
  double most_lever = 0.0;  // largest lever of a force at the tool, m; 1 for a joint that slides
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

// Returns the unit of x's second significant digit. The rules of thumb are accurate to two digits at most.
double second_digit(double x) { return std::pow(10.0, std::floor(std::log10(x)) - 1.0); }

double rounded(double x) { return x > 0.0 ? std::round(x / second_digit(x)) * second_digit(x) : 0.0; }

double rounded_down(double x) { return std::floor(x / second_digit(x)) * second_digit(x); }

// Returns the torque that a drive has left while it holds the arm's weight in the worst pose.
double left_Nm(double torque_Nm, const Load& load) {
  return torque_share * torque_Nm - weight_margin * load.most_gravity;
}

// Throws SetupError for an arm of kilometres or of a thousand tons. Such an arm is a mistake, and its torque exceeds
// the range of max_torque_Nm.
void require_possible(const models::Arm& arm, const description::DriveDescription& drive, const fs::path& urdf) {
  constexpr double most_Nm = 1e6;  // the largest max_torque_Nm that a cell's file may have
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

// Chooses the drive's largest torque, and its largest acceleration, which it must also reach in the pose in which the
// arm's weight takes most torque.
void choose_torque(const ChainJoint& joint, const Load& load, double rotor, description::DriveDescription& drive,
                   std::vector<std::string>& remarks) {
  const double inertia = load.most_inertia + rotor, speed = drive.max_speed_rad_per_s;
  const double usual = usual_per_s * speed;
  const double needed = (weight_margin * load.most_gravity + inertia * usual) / torque_share + hand_N * load.most_lever;
  const bool plausible = left_Nm(joint.max_effort, load) / inertia >= least_per_s * speed;
  drive.max_torque_Nm = plausible ? joint.max_effort : rounded(needed);
  drive.max_acceleration_rad_per_s2 = rounded_down(std::min(usual, left_Nm(drive.max_torque_Nm, load) / inertia));
  if (plausible || !(joint.max_effort > 0.0)) return;
  char text[240];
  std::snprintf(
      text, sizeof text,
      "joint %.60s: its effort of %.3g %s can't bear the arm and bring it to its speed in a third of a second: "
      "%g is taken",
      joint.name.c_str(), joint.max_effort, joint.slides ? "N" : "Nm", drive.max_torque_Nm);
  remarks.emplace_back(text);
}

// Of joints whose URDF says no effort, in one line; empty where there are none.
std::string silent_efforts(const std::vector<ChainJoint>& joints, const description::Cell& cell) {
  std::string names, torques;
  for (std::size_t i = 0; i < joints.size(); ++i) {
    if (joints[i].max_effort > 0.0) continue;
    const std::string comma = names.empty() ? "" : ", ";
    names += comma + joints[i].name;
    torques += comma + description::rounded_text(cell.drives[i].max_torque_Nm) + (joints[i].slides ? " N" : " Nm");
  }
  if (names.empty()) return "";
  return "the URDF says no effort of " + names + ": " + torques + " are taken, by what the arm weighs";
}

}  // namespace

std::vector<std::string> size_drives(description::Cell& cell, const std::vector<ChainJoint>& joints,
                                     const fs::path& urdf) {
  std::vector<std::string> remarks;
  const models::Arm arm(cell);
  double bears_N = most_force_N;
  std::string weakest;
  const std::vector<Load> loads = loads_of(arm);
  double heaviest = 0.0;  // largest mean inertia of the joints that turn
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
    choose_torque(joint, load, rotor, drive, remarks);
    const double for_hand_Nm = left_Nm(drive.max_torque_Nm, load);
    if (for_hand_Nm < bears_N * load.most_lever) {
      bears_N = for_hand_Nm / load.most_lever;
      weakest = joint.name;
    }
    require_possible(arm, drive, urdf);
    drive.rotor_inertia_kg_m2 = rounded(rotor);
    drive.gear_stiffness_Nm_per_rad = rounded(stiffness);
    drive.gear_damping_Nms_per_rad = rounded(damping);
    drive.simulation.gear_damping_Nms_per_rad = rounded(damping);
    drive.simulation.max_torque_Nm = drive.max_torque_Nm;
    drive.simulation.coulomb_friction_Nm = rounded(0.01 * drive.max_torque_Nm);
    drive.simulation.viscous_friction_Nms_per_rad = rounded(0.008 * drive.max_torque_Nm);
  }
  cell.limits.max_force_N = std::max(least_force_N, rounded_down(bears_N));
  if (bears_N < least_force_N) {
    char text[200];
    std::snprintf(text, sizeof text,
                  "in its worst pose joint %.60s bears %.2g N at the tool: a stronger hand overpowers its drive there "
                  "(drive_deviates)",
                  weakest.c_str(), bears_N);
    remarks.emplace_back(text);
  }
  if (std::string silent = silent_efforts(joints, cell); !silent.empty()) remarks.push_back(std::move(silent));
  return remarks;
}

}  // namespace proxarm::command_line
