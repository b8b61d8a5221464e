// The arm's kinematics, statics and dynamics for given joint angles: poses, Jacobian, gravity, masses, elastic gears.
//
// In the URDF, a chain of revolute or prismatic joints must lead from the root to the sensor's link, with one drive of
// the cell for each joint. Joint vectors are in the order of the cell's drives, in rad, Nm and kg m² at the joint
// (after the gear).
//   W ─X_WB─ B ─ joints ─ L (link that carries the sensor) ─X_LS─ S ─X_ST─ T
// MuJoCo reads the URDF. The recursions below are our own: a fixed serial chain needs no more.
//
// Const functions neither allocate, lock nor throw, and several threads may call them in each cycle. Precondition:
// vectors have the size axes(). Finite angles give finite results (but see effective_mass_range), NaN gives NaN;
// callers check their angles.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "models/description/cell.hpp"
#include "models/geometry/geometry.hpp"
#include "models/geometry/small_matrix.hpp"

namespace proxarm::models {

constexpr int max_axes = most_rows;

// Vectors and matrices with a size set at run time, stored in place.
using JointVector = SmallVector;
using JointMatrix = SmallMatrix;
// Column i is the velocity of T in W when axis i moves at 1 rad/s: rows 0..2 velocity (m/s), rows 3..5 angular velocity
// (rad/s).
using Jacobian = Eigen::Matrix<double, 6, Eigen::Dynamic, Eigen::ColMajor, 6, max_axes>;

struct ToolKinematics {
  JointVector q_rad;  // the angles of all this; empty: not computed yet
  Pose X_WT = Pose::Identity();
  Pose X_WS = Pose::Identity();
  Jacobian J_W;                          // geometric, of T
  std::array<Vec3, max_axes> joint_W{};  // origins of the joints in the URDF, outwards from the base
};

// The positions of T and of the joints, and the twist of the gears under gravity.
struct ArmPoints {
  Vec3 tool_W = Vec3::Zero();
  std::array<Vec3, max_axes> joint_W{};  // as in ToolKinematics
  JointVector twist_rad;                 // τ_g/k, by which each motor is ahead of its link, in the order of the drives
};

// The mass that a person feels who pushes the tip while the motors idle: in direction n, (nᵀ J M⁻¹ Jᵀ n)⁻¹.
struct TipMass {
  double min_kg = 0.0, max_kg = 0.0;  // max is infinite if T can't move along max_direction_W (a singularity)
  Vec3 min_direction_W = Vec3::UnitX(), max_direction_W = Vec3::UnitX();
};

class Arm {
 public:
  // Throws description::SetupError for an unreadable URDF; for a drive whose joint is missing, of a type that can't be
  // driven, or not between root and sensor; for a joint without a drive; and for a link without inertia.
  explicit Arm(const description::Cell& cell);

  [[nodiscard]] const std::string& file() const noexcept { return file_; }  // the cell's, for messages
  [[nodiscard]] int axes() const noexcept { return axes_; }
  [[nodiscard]] const std::vector<std::string>& joint_names() const noexcept { return joint_names_; }
  [[nodiscard]] const JointVector& lower_rad() const noexcept { return lower_rad_; }
  [[nodiscard]] const JointVector& upper_rad() const noexcept { return upper_rad_; }
  [[nodiscard]] const JointVector& start_rad() const noexcept { return start_rad_; }
  [[nodiscard]] const JointVector& gear_stiffness_Nm_per_rad() const noexcept { return gear_stiffness_; }  // 0: rigid

  // The drive of the k-th joint of the chain, outwards from the base.
  [[nodiscard]] int drive_along_chain(std::size_t k) const noexcept { return links_[k].drive; }
  // Whether the axis is prismatic; its angle is then in m.
  [[nodiscard]] bool slides(int drive) const noexcept { return slides_[static_cast<std::size_t>(drive)]; }

  // Poses and Jacobian of T and S.
  void kinematics(const JointVector& q, ToolKinematics& out) const noexcept;
  [[nodiscard]] Pose tool_pose(const JointVector& q) const noexcept;    // X_WT
  [[nodiscard]] Pose sensor_pose(const JointVector& q) const noexcept;  // X_WS

  // Computes all points in one pass outwards and one back, without a Jacobian.
  void points(const JointVector& q, ArmPoints& out) const noexcept;
  // Bounds the curvature of paths with constant joint speeds. With C this matrix and p any of the points above,
  //   |d²p/dt²| ≤ |q̇|ᵀ C |q̇|   if q̈ = 0, at any angles, with prismatic joints within their ranges.
  // C_ij = R_j for the outer joint j of the two, where R_j is the largest distance of T from axis j. C_ij is 1 if j is
  // prismatic, and 0 if the inner joint is.
  [[nodiscard]] JointMatrix path_curvature() const;

  // Sets the tool's mass and its centre of mass, relative to S. The inertia about the centre doesn't change. Doesn't
  // allocate, lock or throw.
  void set_tool(double mass_kg, const Vec3& centre_S) noexcept;
  // Torques that hold the arm with its tool at rest against gravity: τ_g = ∂U/∂q.
  [[nodiscard]] JointVector gravity_torque(const JointVector& q) const noexcept;
  // The same while `wrench_W` acts on the tool from outside (force, and torque about T, axes of W): τ_g − Jᵀ w.
  [[nodiscard]] JointVector holding_torque(const JointVector& q, const Wrench& wrench_W) const noexcept;
  // Potential energy in J, zero at W's origin.
  [[nodiscard]] double potential_energy(const JointVector& q) const noexcept;

  // Joint-space mass matrix with the tool, with and without the rotors.
  [[nodiscard]] JointMatrix mass_matrix(const JointVector& q) const noexcept;
  [[nodiscard]] JointMatrix link_mass_matrix(const JointVector& q) const noexcept;
  // (nᵀ J M⁻¹ Jᵀ n)⁻¹ in kg; infinite if T can't move along the unit vector n.
  [[nodiscard]] double effective_mass(const JointVector& q, const Vec3& n_W) const noexcept;
  // `dimensions`: 2 if the tool moves in a plane, 1 on a line. The range is then over directions in this space.
  [[nodiscard]] TipMass effective_mass_range(const JointVector& q, int dimensions = 3) const noexcept;

  // Encoders sit on the motors. Gravity twists gear i by τ_i/k_i, so at rest
  //   q_motor = q + τ_g(q)/k   (motor angles as angles at the joint; k = 0 is a rigid gear)
  [[nodiscard]] JointVector motor_from_link(const JointVector& q) const noexcept;
  [[nodiscard]] JointVector motor_from_link(const JointVector& q, const Wrench& wrench_W) const noexcept;
  // The same while the links start to move with this acceleration: q + (M_link q̈ + τ_g)/k, neglecting speeds. One pass
  // outwards and one back, without the matrix. The outward pass also gives the kinematics at q.
  [[nodiscard]] JointVector motor_from_moving_link(const JointVector& q, const JointVector& acceleration_rad_per_s2,
                                                   ToolKinematics& at_q) const noexcept;
  // The inverse of motor_from_link(), by fixed-point iteration. It contracts by about |∂τ_g/∂q|/k, 0.02 for stiff
  // gears, and stops at steps below 1e-15 rad or after 60 iterations. It doesn't converge if the gears are too soft to
  // hold the arm up.
  [[nodiscard]] JointVector link_from_motor(const JointVector& q_motor) const noexcept;

  // First natural frequency with locked motors: the smallest ω of K v = ω² M_link v, over axes with elastic gears.
  // Infinite if all gears are rigid.
  [[nodiscard]] double first_elastic_frequency_Hz(const JointVector& q) const noexcept;

 private:
  // Link i, with its joint's axis as z. `fixed` is its pose in link i−1 at angle zero (in W for i = 0).
  struct Link {
    Pose fixed = Pose::Identity();
    double mass_kg = 0.0;
    Vec3 centre_of_mass = Vec3::Zero();  // in the link
    Mat3 inertia = Mat3::Zero();         // about the centre of mass, axes of the link
    int drive = 0;                       // index in the cell's drives
    bool slides = false;                 // prismatic along z, q in m; otherwise revolute about z
  };
  struct Frames {
    std::array<Mat3, max_axes> R_W;
    std::array<Vec3, max_axes> p_W;
  };
  void forward(const JointVector& q, Frames& frames) const noexcept;
  void place_tool(const JointVector& q, const Frames& frames, ToolKinematics& out) const noexcept;
  [[nodiscard]] JointVector gravity_torque(const Frames& frames) const noexcept;
  [[nodiscard]] JointVector twisted(const JointVector& q, const JointVector& torque) const noexcept;  // q + τ/k
  [[nodiscard]] Eigen::Matrix3d mobility(const JointVector& q) const noexcept;  // J M⁻¹ Jᵀ, translations
  void add_to_link(Link& link, double mass_kg, const Vec3& centre, const Mat3& inertia) const noexcept;
  struct Bodies;
  void read_chain(const description::Cell& cell);
  int read_joints(const description::Cell& cell, Bodies& bodies);
  void require_whole_chain(const description::Cell& cell, int count) const;
  void read_masses(Bodies& bodies);
  void read_tool(const description::Cell& cell, const Pose& X_nL);

  std::string file_;
  int axes_ = 0;
  std::vector<std::string> joint_names_;
  std::array<Link, max_axes> links_;  // along the chain
  Link bare_;                         // the last link without the tool
  Mat3 tool_inertia_ = Mat3::Zero();  // about the tool's centre of mass, axes of the last link
  Pose X_nS_ = Pose::Identity();      // S and T in the last link
  Pose X_nT_ = Pose::Identity();
  Vec3 gravity_W_ = Vec3::Zero();
  JointVector lower_rad_, upper_rad_, start_rad_, rotor_inertia_, gear_stiffness_;
  std::array<bool, max_axes> slides_{};  // in the order of the drives
};

// The pose of a description: Rz(yaw) Ry(pitch) Rx(roll) and the position.
Pose to_pose(const description::PoseDescription& description) noexcept;

}  // namespace proxarm::models
