#include "models/arm/arm.hpp"

#include <mujoco/mujoco.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "models/arm/arm_urdf.hpp"
#include "models/arm/tool_inertia.hpp"
#include "models/base/setup_error.hpp"
#include "models/base/text.hpp"
#include "models/description/drive.hpp"
#include "models/files/yaml_file.hpp"
#include "models/geometry/eigenvalues.hpp"
#include "models/geometry/linear_systems.hpp"

namespace proxarm::models {
namespace {

using description::Cell;
using description::in_quotes;
using description::SetupError;

// Returns an error in the cell's file, which has already been read. Reads the file again to find the line of the key.
SetupError in_cell(const Cell& cell, const std::string& list, std::size_t index, const std::string& key,
                   std::string found, std::string expected, std::string advice = {}) {
  const bool element = list == "drives";
  try {
    const auto root = description::YamlNode::load(cell.file);
    const auto node = element ? description::drive_nodes(root).at(index) : root.map(list);
    const SetupError mistake = node.error_at(key, expected, found, advice);
    return element ? description::of_drive(node, mistake) : mistake;
  } catch (const std::exception&) {  // the cell doesn't come from a file
    const std::string place = element ? list + "[" + std::to_string(index) + "]" : list;
    return SetupError({.file = cell.file.string(),
                       .key = place + "." + key,
                       .found = std::move(found),
                       .expected = std::move(expected),
                       .advice = std::move(advice)});
  }
}

std::string meant(const std::string& word, const std::vector<std::string>& names) {
  const std::string near = description::nearest(word, names);
  return near.empty() ? "" : "did you mean " + in_quotes(near) + "?";
}

bool is_axis(const UrdfJoint& joint) {
  return joint.type == "revolute" || joint.type == "continuous" || joint.type == "prismatic";
}

// Checks that each drive has a joint, and each moving joint has a drive.
void check_joints(const Cell& cell, const Urdf& urdf) {
  std::vector<std::string> names;
  for (const UrdfJoint& joint : urdf.joints) {
    if (is_axis(joint)) names.push_back(joint.name);
  }
  for (std::size_t i = 0; i < cell.drives.size(); ++i) {
    const std::string& name = cell.drives[i].joint;
    const auto joint =
        std::find_if(urdf.joints.begin(), urdf.joints.end(), [&](const auto& j) { return j.name == name; });
    if (joint == urdf.joints.end()) {
      throw in_cell(cell, "drives", i, "joint", in_quotes(name),
                    "a joint of " + urdf.file.filename().string() + ": " + description::one_of(names),
                    meant(name, names));
    }
    if (!is_axis(*joint)) {
      throw in_cell(cell, "drives", i, "joint", in_quotes(name) + ", a " + joint->type + " joint",
                    "a revolute, continuous or prismatic joint: " + description::one_of(names));
    }
  }
  for (const UrdfJoint& joint : urdf.joints) {
    if (joint.type == "fixed") continue;
    const bool driven =
        std::any_of(cell.drives.begin(), cell.drives.end(), [&](const auto& d) { return d.joint == joint.name; });
    if (!driven) {
      throw SetupError({.file = urdf.file.string(),
                        .line = joint.line,
                        .message = joint.type + " joint " + in_quotes(joint.name) + " has no drive in " +
                                   cell.file.filename().string(),
                        .advice = "add a drive, or make the joint fixed"});
    }
  }
}

void check_sensor_link(const Cell& cell, const Urdf& urdf) {
  std::vector<std::string> names;
  for (const UrdfLink& link : urdf.links) names.push_back(link.name);
  if (std::find(names.begin(), names.end(), cell.sensor.link) == names.end()) {
    throw in_cell(cell, "sensor", 0, "link", in_quotes(cell.sensor.link),
                  "a link of " + urdf.file.filename().string() + ": " + description::one_of(names),
                  meant(cell.sensor.link, names));
  }
}

void check_range(const Cell& cell, std::size_t drive, const mjModel& model, int joint) {
  if (!model.jnt_limited[joint]) return;
  const double low = model.jnt_range[2 * joint], high = model.jnt_range[2 * joint + 1];
  const auto& range = cell.drives[drive].range_rad;
  constexpr double written_rad = 1e-5;  // limits are written with few digits: 2.0944 must match 2.094395
  if (range[0] >= low - written_rad && range[1] <= high + written_rad) return;
  const auto text = [](double a, double b) {
    return "[" + description::number_text(a) + ", " + description::number_text(b) + "]";
  };
  throw in_cell(cell, "drives", drive, "range_rad", text(range[0], range[1]),
                "a range within the URDF's limits of that joint, " + text(low, high) + " rad");
}

Pose pose(const double* position, const double* quaternion) {
  Pose X = Pose::Identity();
  X.linear() =
      Eigen::Quaterniond(quaternion[0], quaternion[1], quaternion[2], quaternion[3]).normalized().toRotationMatrix();
  X.translation() = Vec3(position[0], position[1], position[2]);
  return X;
}

// Returns a rotation whose z axis is `axis`. The result is exact if `axis` is x, y or z, which is usual.
Pose turn_z_to(const Vec3& axis) {
  Eigen::Index least = 0;
  axis.cwiseAbs().minCoeff(&least);
  Pose A = Pose::Identity();
  const Vec3 z = axis.normalized(), x = Vec3::Unit(least).cross(z).normalized();
  A.linear() << x, z.cross(x), z;
  return A;
}

Mat3 steiner(double mass, const Vec3& r) { return mass * (r.squaredNorm() * Mat3::Identity() - r * r.transpose()); }

}  // namespace

Pose to_pose(const description::PoseDescription& d) noexcept {
  Pose X = Pose::Identity();
  X.linear() = (Eigen::AngleAxisd(d.rpy_rad[2], Vec3::UnitZ()) * Eigen::AngleAxisd(d.rpy_rad[1], Vec3::UnitY()) *
                Eigen::AngleAxisd(d.rpy_rad[0], Vec3::UnitX()))
                   .toRotationMatrix();
  X.translation() = Vec3(d.position_m[0], d.position_m[1], d.position_m[2]);
  return X;
}

// ---- set-up ---------------------------------------------------------------------------------------------------------

Arm::Arm(const Cell& cell) : file_(cell.file.string()) {
  axes_ = static_cast<int>(cell.drives.size());
  if (axes_ < 1 || axes_ > max_axes) {
    throw SetupError({.file = cell.file.string(),
                      .key = "drives",
                      .found = std::to_string(axes_) + " drives",
                      .expected = "1 to " + std::to_string(max_axes)});
  }
  const auto n = static_cast<std::size_t>(axes_);
  gravity_W_ = Vec3(cell.gravity_W_m_per_s2[0], cell.gravity_W_m_per_s2[1], cell.gravity_W_m_per_s2[2]);
  for (JointVector* v : {&lower_rad_, &upper_rad_, &start_rad_, &rotor_inertia_, &gear_stiffness_}) v->setZero(axes_);
  for (std::size_t i = 0; i < n; ++i) {
    const auto& drive = cell.drives[i];
    const auto k = static_cast<Eigen::Index>(i);
    joint_names_.push_back(drive.joint);
    lower_rad_[k] = drive.range_rad[0];
    upper_rad_[k] = drive.range_rad[1];
    rotor_inertia_[k] = drive.rotor_inertia_kg_m2;
    gear_stiffness_[k] = drive.gear_stiffness_Nm_per_rad;
    if (i < cell.start_rad.size()) start_rad_[k] = cell.start_rad[i];
  }
  read_chain(cell);
}

// MuJoCo's bodies, assigned to the links of the chain. A body without a joint of the chain belongs to the last link
// before it.
struct Arm::Bodies {
  Bodies(const mjModel& m, const std::string& sensor_link) : model(m) {
    for (int body = mj_name2id(&m, mjOBJ_BODY, sensor_link.c_str()); body > 0; body = m.body_parentid[body]) {
      path.insert(path.begin(), body);
    }
  }

  const mjModel& model;
  std::vector<int> path;  // bodies from the world to the sensor's link
  std::vector<int> link = std::vector<int>(static_cast<std::size_t>(model.nbody), -1);
  std::vector<Pose> X_link = std::vector<Pose>(link.size(), Pose::Identity());  // pose of each body in its link
};

void Arm::read_chain(const Cell& cell) {
  const Urdf urdf = load_urdf(cell.urdf);
  check_joints(cell, urdf);
  check_sensor_link(cell, urdf);
  const MujocoModel model = compile(urdf);
  Bodies bodies(*model, cell.sensor.link);
  require_whole_chain(cell, read_joints(cell, bodies));
  read_masses(bodies);
  read_tool(cell, bodies.X_link[static_cast<std::size_t>(bodies.path.back())]);
}

// Turns the bodies of the path that have a joint into links of the chain. Returns the number of links.
int Arm::read_joints(const Cell& cell, Bodies& bodies) {
  const mjModel& m = bodies.model;
  Pose X_before = to_pose(cell.base_W);  // pose of the last body in its link
  int count = 0;
  for (const int body : bodies.path) {
    const auto b = static_cast<std::size_t>(body);
    X_before = X_before * pose(m.body_pos + 3 * body, m.body_quat + 4 * body);
    if (m.body_jntnum[body] > 0) {
      const int joint = m.body_jntadr[body];
      const auto drive = static_cast<std::size_t>(
          std::find(joint_names_.begin(), joint_names_.end(), mj_id2name(&m, mjOBJ_JOINT, joint)) -
          joint_names_.begin());
      check_range(cell, drive, m, joint);
      const Pose A = turn_z_to(Vec3(m.jnt_axis[3 * joint], m.jnt_axis[3 * joint + 1], m.jnt_axis[3 * joint + 2]));
      Link& link = links_[static_cast<std::size_t>(count++)];
      link.drive = static_cast<int>(drive);
      link.slides = slides_[drive] = m.jnt_type[joint] == mjJNT_SLIDE;
      link.fixed = X_before * A;
      X_before = A.inverse();
    }
    bodies.link[b] = count - 1;
    bodies.X_link[b] = X_before;
  }
  return count;
}

// Checks that the joint of each drive is one of the `count` joints between the root and the sensor.
void Arm::require_whole_chain(const Cell& cell, int count) const {
  if (count == axes_) return;
  for (std::size_t i = 0; i < joint_names_.size(); ++i) {
    const auto used = [&](const Link& link) { return link.drive == static_cast<int>(i); };
    if (std::any_of(links_.begin(), links_.begin() + count, used)) continue;
    throw in_cell(cell, "drives", i, "joint", in_quotes(joint_names_[i]),
                  "a joint between the URDF's root and the sensor's link " + in_quotes(cell.sensor.link));
  }
}

// Adds each body's mass to its link. MuJoCo numbers parents before their children.
void Arm::read_masses(Bodies& bodies) {
  const mjModel& m = bodies.model;
  for (int body = 1; body < m.nbody; ++body) {
    const auto b = static_cast<std::size_t>(body), parent = static_cast<std::size_t>(m.body_parentid[body]);
    if (std::find(bodies.path.begin(), bodies.path.end(), body) == bodies.path.end()) {
      bodies.link[b] = bodies.link[parent];
      bodies.X_link[b] = bodies.X_link[parent] * pose(m.body_pos + 3 * body, m.body_quat + 4 * body);
    }
    if (bodies.link[b] < 0) continue;
    const Pose X_principal = bodies.X_link[b] * pose(m.body_ipos + 3 * body, m.body_iquat + 4 * body);
    const Vec3 principal(m.body_inertia[3 * body], m.body_inertia[3 * body + 1], m.body_inertia[3 * body + 2]);
    add_to_link(links_[static_cast<std::size_t>(bodies.link[b])], m.body_mass[body], X_principal.translation(),
                X_principal.linear() * principal.asDiagonal() * X_principal.linear().transpose());
  }
}

void Arm::read_tool(const Cell& cell, const Pose& X_nL) {
  X_nS_ = X_nL * to_pose(cell.sensor.pose_link);
  X_nT_ = X_nS_ * to_pose(cell.tool.handle_S);
  const auto& c = cell.tool.centre_of_mass_S_m;
  bare_ = links_[static_cast<std::size_t>(axes_ - 1)];
  tool_inertia_ = X_nS_.linear() * inertia_about_centre_S(cell.tool) * X_nS_.linear().transpose();
  set_tool(cell.tool.mass_kg, Vec3(c[0], c[1], c[2]));
}

void Arm::set_tool(double mass_kg, const Vec3& centre_S) noexcept {
  Link& last = links_[static_cast<std::size_t>(axes_ - 1)];
  last = bare_;
  add_to_link(last, mass_kg, X_nS_ * centre_S, tool_inertia_);
}

void Arm::add_to_link(Link& link, double mass_kg, const Vec3& centre, const Mat3& inertia) const noexcept {
  if (mass_kg <= 0.0) return;
  const double mass = link.mass_kg + mass_kg;
  const Vec3 both = (link.mass_kg * link.centre_of_mass + mass_kg * centre) / mass;
  link.inertia += steiner(link.mass_kg, link.centre_of_mass - both) + inertia + steiner(mass_kg, centre - both);
  link.centre_of_mass = both;
  link.mass_kg = mass;
}

// ---- kinematics -----------------------------------------------------------------------------------------------------

void Arm::forward(const JointVector& q, Frames& frames) const noexcept {
  for (int i = 0; i < axes_; ++i) {
    const auto k = static_cast<std::size_t>(i);
    const Link& link = links_[k];
    const double angle = link.slides ? 0.0 : q[link.drive];
    const double c = std::cos(angle), s = std::sin(angle);
    Mat3 R;
    Vec3 p;
    if (i == 0) {
      R = link.fixed.linear();
      p = link.fixed.translation();
    } else {
      R.noalias() = frames.R_W[k - 1] * link.fixed.linear();
      p.noalias() = frames.R_W[k - 1] * link.fixed.translation();
      p += frames.p_W[k - 1];
    }
    Mat3& turned = frames.R_W[k];  // R Rz(q)
    turned.col(0) = c * R.col(0) + s * R.col(1);
    turned.col(1) = c * R.col(1) - s * R.col(0);
    turned.col(2) = R.col(2);
    if (link.slides) p += q[link.drive] * R.col(2);
    frames.p_W[k] = p;
  }
}

void Arm::kinematics(const JointVector& q, ToolKinematics& out) const noexcept {
  Frames frames;
  forward(q, frames);
  place_tool(q, frames, out);
}

void Arm::place_tool(const JointVector& q, const Frames& frames, ToolKinematics& out) const noexcept {
  out.q_rad = q;
  const auto last = static_cast<std::size_t>(axes_ - 1);
  const auto place = [&](Pose& X, const Pose& X_n) {
    X.linear().noalias() = frames.R_W[last] * X_n.linear();
    X.translation().noalias() = frames.R_W[last] * X_n.translation();
    X.translation() += frames.p_W[last];
    X.makeAffine();
  };
  place(out.X_WS, X_nS_);
  place(out.X_WT, X_nT_);
  out.J_W.resize(6, axes_);
  const Vec3 p_T = out.X_WT.translation();
  for (int i = 0; i < axes_; ++i) {
    const auto k = static_cast<std::size_t>(i);
    const Vec3 z = frames.R_W[k].col(2);
    auto column = out.J_W.col(links_[k].drive);
    column.head<3>() = links_[k].slides ? z : z.cross(p_T - frames.p_W[k]);
    column.tail<3>() = links_[k].slides ? Vec3(Vec3::Zero()) : z;
    out.joint_W[k] = frames.p_W[k];
  }
}

Pose Arm::tool_pose(const JointVector& q) const noexcept {
  ToolKinematics kinematics_at_q;
  kinematics(q, kinematics_at_q);
  return kinematics_at_q.X_WT;
}

Pose Arm::sensor_pose(const JointVector& q) const noexcept {
  ToolKinematics kinematics_at_q;
  kinematics(q, kinematics_at_q);
  return kinematics_at_q.X_WS;
}

void Arm::points(const JointVector& q, ArmPoints& out) const noexcept {
  Frames frames;
  forward(q, frames);
  for (int i = 0; i < axes_; ++i) out.joint_W[static_cast<std::size_t>(i)] = frames.p_W[static_cast<std::size_t>(i)];
  const auto last = static_cast<std::size_t>(axes_ - 1);
  out.tool_W.noalias() = frames.R_W[last] * X_nT_.translation();
  out.tool_W += frames.p_W[last];
  out.twist_rad = gravity_torque(frames);
  for (int i = 0; i < axes_; ++i) {
    out.twist_rad[i] = gear_stiffness_[i] > 0.0 ? out.twist_rad[i] / gear_stiffness_[i] : 0.0;
  }
}

JointMatrix Arm::path_curvature() const {
  // The loop goes from the outermost joint inwards. stretched_m is the largest distance from the origin of the next
  // joint to T. The lever of axis j is stretched_m plus the part of link j that is perpendicular to the axis.
  JointMatrix C = JointMatrix::Zero(axes_, axes_);
  double stretched_m = 0.0;
  for (int j = axes_ - 1; j >= 0; --j) {
    const auto k = static_cast<std::size_t>(j);
    const Link& link = links_[k];
    const Vec3 next = j == axes_ - 1 ? X_nT_.translation() : links_[k + 1].fixed.translation();
    const double lever_m = link.slides ? 1.0 : next.head<2>().norm() + stretched_m;
    for (int i = 0; i <= j; ++i) {
      const Link& inner = links_[static_cast<std::size_t>(i)];
      C(inner.drive, link.drive) = C(link.drive, inner.drive) = inner.slides ? 0.0 : lever_m;
    }
    stretched_m += next.norm();
    if (link.slides) stretched_m += std::max(std::abs(lower_rad_[link.drive]), std::abs(upper_rad_[link.drive]));
  }
  return C;
}

// ---- statics --------------------------------------------------------------------------------------------------------

JointVector Arm::gravity_torque(const Frames& frames) const noexcept {
  // Let m_i and c_i be the mass and centre of mass of everything from link i outwards. Then τ_i = −z_i · (c_i − p_i) ×
  // m_i g for a revolute axis, and τ_i = −z_i · m_i g for a prismatic axis.
  JointVector torque(axes_);
  double mass = 0.0;
  Vec3 moment = Vec3::Zero();  // the sum of mass times centre of mass: m_i c_i
  for (int i = axes_ - 1; i >= 0; --i) {
    const auto k = static_cast<std::size_t>(i);
    const Link& link = links_[k];
    mass += link.mass_kg;
    moment += link.mass_kg * (frames.p_W[k] + frames.R_W[k] * link.centre_of_mass);
    const Vec3 lever = moment - mass * frames.p_W[k];
    const Vec3 load = link.slides ? Vec3(mass * gravity_W_) : Vec3(lever.cross(gravity_W_));
    torque[link.drive] = -frames.R_W[k].col(2).dot(load);
  }
  return torque;
}

JointVector Arm::gravity_torque(const JointVector& q) const noexcept {
  Frames frames;
  forward(q, frames);
  return gravity_torque(frames);
}

JointVector Arm::holding_torque(const JointVector& q, const Wrench& wrench_W) const noexcept {
  ToolKinematics at_q;
  kinematics(q, at_q);
  Vec<6> w;
  w << wrench_W.force, wrench_W.torque;
  JointVector torque = gravity_torque(q);
  torque.noalias() -= at_q.J_W.transpose() * w;
  return torque;
}

double Arm::potential_energy(const JointVector& q) const noexcept {
  Frames frames;
  forward(q, frames);
  double energy = 0.0;
  for (int i = 0; i < axes_; ++i) {
    const auto k = static_cast<std::size_t>(i);
    energy -= links_[k].mass_kg * gravity_W_.dot(frames.p_W[k] + frames.R_W[k] * links_[k].centre_of_mass);
  }
  return energy;
}

JointVector Arm::motor_from_link(const JointVector& q) const noexcept { return twisted(q, gravity_torque(q)); }

JointVector Arm::motor_from_link(const JointVector& q, const Wrench& wrench_W) const noexcept {
  return twisted(q, holding_torque(q, wrench_W));
}

JointVector Arm::motor_from_moving_link(const JointVector& q, const JointVector& q_dd,
                                        ToolKinematics& at_q) const noexcept {
  // Newton–Euler recursion (Luh, Walker and Paul 1980) with all speeds zero. The pass outwards starts from a₀ = −g:
  //   α_i = α_{i−1} + z_i q̈_i,   a_i = a_{i−1} + α_{i−1} × (p_i − p_{i−1})          (prismatic: add z_i q̈_i to a_i)
  //   F_i = m_i (a_i + α_i × (c_i − p_i)),   N_i = I_i α_i
  // The pass back computes f_i and n_i (about p_i), the load of link i and of all links beyond link i:
  //   f_i = F_i + f_{i+1},   n_i = N_i + (c_i − p_i) × F_i + n_{i+1} + (p_{i+1} − p_i) × f_{i+1},   τ_i = z_i · n_i
  Frames frames;
  forward(q, frames);
  place_tool(q, frames, at_q);
  std::array<Vec3, max_axes> F, N;
  Vec3 alpha = Vec3::Zero(), a = -gravity_W_;
  for (int i = 0; i < axes_; ++i) {
    const auto k = static_cast<std::size_t>(i);
    const Link& link = links_[k];
    const Mat3& R = frames.R_W[k];
    if (i > 0) a += alpha.cross(frames.p_W[k] - frames.p_W[k - 1]);
    (link.slides ? a : alpha) += q_dd[link.drive] * R.col(2);
    const Vec3 lever = R * link.centre_of_mass;
    F[k] = link.mass_kg * (a + alpha.cross(lever));
    const Vec3 alpha_in_link = R.transpose() * alpha;
    N[k] = R * Vec3(link.inertia * alpha_in_link) + lever.cross(F[k]);
  }
  JointVector torque(axes_);
  Vec3 f = Vec3::Zero(), n = Vec3::Zero();
  for (int i = axes_ - 1; i >= 0; --i) {
    const auto k = static_cast<std::size_t>(i);
    if (i + 1 < axes_) n += (frames.p_W[k + 1] - frames.p_W[k]).cross(f);
    f += F[k];
    n += N[k];
    torque[links_[k].drive] = frames.R_W[k].col(2).dot(links_[k].slides ? f : n);
  }
  return twisted(q, torque);
}

JointVector Arm::twisted(const JointVector& q, const JointVector& torque) const noexcept {
  JointVector motor = q;
  for (int i = 0; i < axes_; ++i) {
    if (gear_stiffness_[i] > 0.0) motor[i] += torque[i] / gear_stiffness_[i];
  }
  return motor;
}

JointVector Arm::link_from_motor(const JointVector& q_motor) const noexcept {
  JointVector q = q_motor;
  for (int iteration = 0; iteration < 60; ++iteration) {
    const JointVector torque = gravity_torque(q);
    double step = 0.0;
    for (int i = 0; i < axes_; ++i) {
      const double next = gear_stiffness_[i] > 0.0 ? q_motor[i] - torque[i] / gear_stiffness_[i] : q_motor[i];
      step = std::max(step, std::abs(next - q[i]));
      q[i] = next;
    }
    if (step < 1e-15) break;
  }
  return q;
}

// ---- dynamics -------------------------------------------------------------------------------------------------------

JointMatrix Arm::link_mass_matrix(const JointVector& q) const noexcept {
  // Composite rigid bodies (Walker and Orin 1982):
  // 1. Everything from link j outwards has mass m, centre c and inertia I about c.
  // 2. To turn this about z_j at 1 rad/s², the force F = m z_j × (c − p_j) at c and the torque I z_j are necessary.
  // 3. The part of them that axis i ≤ j must supply is M_ij = z_i · (I z_j + (c − p_i) × F).
  // 4. A prismatic axis j needs F = m z_j and no torque. A prismatic axis i must supply z_i · F.
  Frames frames;
  forward(q, frames);
  JointMatrix M(axes_, axes_);
  double mass = 0.0;
  Vec3 centre = Vec3::Zero();
  Mat3 inertia = Mat3::Zero();
  for (int j = axes_ - 1; j >= 0; --j) {
    const auto k = static_cast<std::size_t>(j);
    const Link& link = links_[k];
    if (link.mass_kg > 0.0) {
      const Vec3 c = frames.p_W[k] + frames.R_W[k] * link.centre_of_mass;
      const double both = mass + link.mass_kg;
      const Vec3 new_centre = (mass * centre + link.mass_kg * c) / both;
      inertia += steiner(mass, centre - new_centre) + steiner(link.mass_kg, c - new_centre) +
                 frames.R_W[k] * link.inertia * frames.R_W[k].transpose();
      mass = both;
      centre = new_centre;
    }
    const Vec3 z = frames.R_W[k].col(2);
    const Vec3 F = mass * (link.slides ? z : Vec3(z.cross(centre - frames.p_W[k])));
    const Vec3 torque = link.slides ? Vec3(Vec3::Zero()) : Vec3(inertia * z);
    for (int i = 0; i <= j; ++i) {
      const auto h = static_cast<std::size_t>(i);
      const Vec3 load = links_[h].slides ? F : Vec3(torque + (centre - frames.p_W[h]).cross(F));
      const double value = frames.R_W[h].col(2).dot(load);
      M(links_[h].drive, link.drive) = M(link.drive, links_[h].drive) = value;
    }
  }
  return M;
}

JointMatrix Arm::mass_matrix(const JointVector& q) const noexcept {
  JointMatrix M = link_mass_matrix(q);
  M.diagonal() += rotor_inertia_;
  return M;
}

Eigen::Matrix3d Arm::mobility(const JointVector& q) const noexcept {
  ToolKinematics at_q;
  kinematics(q, at_q);
  const JointMatrix M = mass_matrix(q);
  const SmallColumns3 Jt = at_q.J_W.topRows<3>().transpose();
  return Jt.transpose().lazyProduct(solve_positive_definite(M, Jt));
}

double Arm::effective_mass(const JointVector& q, const Vec3& n_W) const noexcept {
  const double inverse = n_W.dot(mobility(q) * n_W);
  return inverse > 0.0 ? 1.0 / inverse : std::numeric_limits<double>::infinity();
}

TipMass Arm::effective_mass_range(const JointVector& q, int dimensions) const noexcept {
  const Eigen::Matrix3d A = mobility(q);
  // The solver is iterative, because the closed form for 3×3 loses half of the digits of close eigenvalues.
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(A);
  const Vec3& values = eigen.eigenvalues();
  TipMass tip;
  const double infinite = std::numeric_limits<double>::infinity();
  // An eigenvalue has an error of about n ε times the largest eigenvalue. If it is below this error, T can't move in
  // its direction.
  const double least = 16.0 * std::numeric_limits<double>::epsilon() * values[2];
  tip.min_kg = values[2] > 0.0 ? 1.0 / values[2] : infinite;
  const int slowest = 3 - dimensions;
  tip.max_kg = values[slowest] > least ? 1.0 / values[slowest] : infinite;
  tip.min_direction_W = eigen.eigenvectors().col(2);
  tip.max_direction_W = eigen.eigenvectors().col(slowest);
  return tip;
}

double Arm::first_elastic_frequency_Hz(const JointVector& q) const noexcept {
  // Axes with a rigid gear are locked together with their motors, so only the block of the elastic axes remains. With K
  // = D², K v = ω² M v becomes D⁻¹ M D⁻¹ u = u/ω².
  const JointMatrix M = link_mass_matrix(q);
  std::array<int, max_axes> elastic{};
  int n = 0;
  for (int i = 0; i < axes_; ++i) {
    if (gear_stiffness_[i] > 0.0) elastic[static_cast<std::size_t>(n++)] = i;
  }
  if (n == 0) return std::numeric_limits<double>::infinity();
  JointMatrix A(n, n);
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      const int a = elastic[static_cast<std::size_t>(i)], b = elastic[static_cast<std::size_t>(j)];
      A(i, j) = M(a, b) / std::sqrt(gear_stiffness_[a] * gear_stiffness_[b]);
    }
  }
  return 1.0 / (2.0 * std::numbers::pi * std::sqrt(symmetric_eigenvalues(A)[n - 1]));
}

}  // namespace proxarm::models
