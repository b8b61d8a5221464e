// Computes an arm's kinematics, statics and dynamics for given joint angles: poses, Jacobian, gravity, masses, elastic
// gears.
//
// In the URDF, a chain of revolute or prismatic joints must lead from the root to the sensor's link. The cell must have
// one drive for each of these joints. Joint vectors are in the order of the cell's drives, in rad, Nm and kg m² at the
// joint (after the gear).
//   W ─X_WB─ B ─ joints ─ L (link that carries the sensor) ─X_LS─ S ─X_ST─ T
// MuJoCo reads the URDF. The recursions below don't use MuJoCo, because a fixed serial chain needs little code.
//
// Const functions don't allocate, lock or throw, and several threads may call them in each cycle. Precondition: vectors
// have the size axes(). Finite angles give finite results (with an exception in effective_mass_range), and NaN gives
// NaN. Callers check their angles.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "models/description/cell.hpp"
#include "models/geometry/geometry.hpp"
#include "models/geometry/small_matrix.hpp"

namespace proxarm::models {

constexpr int max_axes = most_rows;

// Vectors and matrices whose size is set at run time. Their elements are stored in the object.
using JointVector = SmallVector;
using JointMatrix = SmallMatrix;
// Column i is the velocity of T in W when only axis i moves, at 1 rad/s. Rows 0..2: velocity (m/s). Rows 3..5: angular
// velocity (rad/s).
using Jacobian = Eigen::Matrix<double, 6, Eigen::Dynamic, Eigen::ColMajor, 6, max_axes>;

struct ToolKinematics {
  JointVector q_rad;  // the angles for which the other fields were computed; empty: not computed yet
  Pose X_WT = Pose::Identity();
  Pose X_WS = Pose::Identity();
  Jacobian J_W;                          // geometric Jacobian of T
  std::array<Vec3, max_axes> joint_W{};  // origins of the joints in the URDF, ordered outwards from the base
};

// The positions of T and of the joints, and the twist of the gears by gravity.
struct ArmPoints {
  Vec3 tool_W = Vec3::Zero();
  std::array<Vec3, max_axes> joint_W{};  // as in ToolKinematics
  // τ_g/k, the angle by which each motor is ahead of its link, in the order of the drives.
  JointVector twist_rad;
};

// The mass that a person feels when pushing the tip while the motors idle. In direction n it is (nᵀ J M⁻¹ Jᵀ n)⁻¹.
struct TipMass {
  double min_kg = 0.0, max_kg = 0.0;  // max_kg is infinite if T can't move along max_direction_W (a singularity)
  Vec3 min_direction_W = Vec3::UnitX(), max_direction_W = Vec3::UnitX();
};

class Arm {
 public:
  // Throws description::SetupError if the URDF can't be read; if a drive's joint is missing, has a type that can't be
  // driven, or isn't between root and sensor; if a joint has no drive; or if a link has no inertia.
  explicit Arm(const description::Cell& cell);

  [[nodiscard]] const std::string& file() const noexcept { return file_; }  // path of the cell's file, for messages
  [[nodiscard]] int axes() const noexcept { return axes_; }
  [[nodiscard]] const std::vector<std::string>& joint_names() const noexcept { return joint_names_; }
  [[nodiscard]] const JointVector& lower_rad() const noexcept { return lower_rad_; }
  [[nodiscard]] const JointVector& upper_rad() const noexcept { return upper_rad_; }
  [[nodiscard]] const JointVector& start_rad() const noexcept { return start_rad_; }
  // 0: the gear is rigid.
  [[nodiscard]] const JointVector& gear_stiffness_Nm_per_rad() const noexcept { return gear_stiffness_; }

  // Returns the index of the drive of the k-th joint of the chain, counted outwards from the base.
  [[nodiscard]] int drive_along_chain(std::size_t k) const noexcept { return links_[k].drive; }
  // Whether the axis of this drive is prismatic. The axis' angle is then in m.
  [[nodiscard]] bool slides(int drive) const noexcept { return slides_[static_cast<std::size_t>(drive)]; }

  // Computes the poses of T and S, and the Jacobian of T.
  void kinematics(const JointVector& q, ToolKinematics& out) const noexcept;
  [[nodiscard]] Pose tool_pose(const JointVector& q) const noexcept;    // X_WT
  [[nodiscard]] Pose sensor_pose(const JointVector& q) const noexcept;  // X_WS

  // Computes the points without a Jacobian, in one pass outwards and one pass back.
  void points(const JointVector& q, ArmPoints& out) const noexcept;
  // Returns a matrix C that bounds the curvature of paths with constant joint speeds. For each point p of ArmPoints,
  //   |d²p/dt²| ≤ |q̇|ᵀ C |q̇|   if q̈ = 0, at any angles, with prismatic joints within their ranges.
  // Let j be the outer joint and i the inner joint, or i = j. C_ij = R_j, where R_j is the largest distance of T from
  // axis j. Exceptions: C_ij is 0 if i is prismatic; otherwise C_ij is 1 if j is prismatic.
  [[nodiscard]] JointMatrix path_curvature() const;

  // Sets the tool's mass, and its centre of mass relative to S. The tool's inertia about the centre of mass doesn't
  // change. Doesn't allocate, lock or throw.
  void set_tool(double mass_kg, const Vec3& centre_S) noexcept;
  // Returns the torques that hold the arm and its tool at rest against gravity: τ_g = ∂U/∂q.
  [[nodiscard]] JointVector gravity_torque(const JointVector& q) const noexcept;
  // Returns the torques that hold the arm at rest while `wrench_W` also acts on the tool from outside: τ_g − Jᵀ w. The
  // wrench is a force and a torque about T, in the axes of W.
  [[nodiscard]] JointVector holding_torque(const JointVector& q, const Wrench& wrench_W) const noexcept;
  // Returns the potential energy in J. It is zero for masses at W's origin.
  [[nodiscard]] double potential_energy(const JointVector& q) const noexcept;

  // Returns the mass matrix in joint space with the tool. mass_matrix() includes the rotors, link_mass_matrix()
  // doesn't.
  [[nodiscard]] JointMatrix mass_matrix(const JointVector& q) const noexcept;
  [[nodiscard]] JointMatrix link_mass_matrix(const JointVector& q) const noexcept;
  // Returns (nᵀ J M⁻¹ Jᵀ n)⁻¹ in kg; infinite if T can't move along the unit vector n.
  [[nodiscard]] double effective_mass(const JointVector& q, const Vec3& n_W) const noexcept;
  // Returns the range of effective_mass() over all directions. `dimensions`: 2 if the tool moves in a plane, 1 if it
  // moves on a line; only directions in this plane or line then count.
  [[nodiscard]] TipMass effective_mass_range(const JointVector& q, int dimensions = 3) const noexcept;

  // Returns the motor angles at rest, which the encoders show because they are on the motors. Gravity twists gear i by
  // τ_i/k_i, so
  //   q_motor = q + τ_g(q)/k   (as angles at the joint; k = 0 means a rigid gear)
  // The second function uses holding_torque() instead of τ_g, and so includes a wrench on the tool.
  [[nodiscard]] JointVector motor_from_link(const JointVector& q) const noexcept;
  [[nodiscard]] JointVector motor_from_link(const JointVector& q, const Wrench& wrench_W) const noexcept;
  // Returns the motor angles at which the links start to move with this acceleration: q + (M_link q̈ + τ_g)/k, where
  // speeds are neglected. Takes one pass outwards and one pass back, without the mass matrix. The outward pass also
  // fills in the kinematics at q.
  [[nodiscard]] JointVector motor_from_moving_link(const JointVector& q, const JointVector& acceleration_rad_per_s2,
                                                   ToolKinematics& at_q) const noexcept;
  // The inverse of motor_from_link(), by fixed-point iteration. An iteration multiplies the error by about |∂τ_g/∂q|/k,
  // which is 0.02 for stiff gears. The function stops at a step below 1e-15 rad or after 60 iterations. It doesn't
  // converge if the gears are too soft to hold the arm up.
  [[nodiscard]] JointVector link_from_motor(const JointVector& q_motor) const noexcept;

  // Returns the first natural frequency with locked motors: the smallest ω of K v = ω² M_link v, over the axes with
  // elastic gears. Infinite if all gears are rigid.
  [[nodiscard]] double first_elastic_frequency_Hz(const JointVector& q) const noexcept;

 private:
  // Link i, whose z axis is the axis of its joint. `fixed` is the link's pose in link i−1 at joint angle zero (in W for
  // i = 0).
  struct Link {
    Pose fixed = Pose::Identity();
    double mass_kg = 0.0;
    Vec3 centre_of_mass = Vec3::Zero();  // in the link's frame, m
    Mat3 inertia = Mat3::Zero();         // about the centre of mass, in the axes of the link
    int drive = 0;                       // index in the cell's drives
    bool slides = false;                 // true: prismatic along z, q in m; false: revolute about z
  };
  struct Frames {
    std::array<Mat3, max_axes> R_W;
    std::array<Vec3, max_axes> p_W;
  };
  void forward(const JointVector& q, Frames& frames) const noexcept;
  void place_tool(const JointVector& q, const Frames& frames, ToolKinematics& out) const noexcept;
  [[nodiscard]] JointVector gravity_torque(const Frames& frames) const noexcept;
  [[nodiscard]] JointVector twisted(const JointVector& q, const JointVector& torque) const noexcept;  // returns q + τ/k
  [[nodiscard]] Eigen::Matrix3d mobility(const JointVector& q) const noexcept;  // returns J M⁻¹ Jᵀ for translations
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
  Link bare_;                         // the last link of the chain without the tool
  Mat3 tool_inertia_ = Mat3::Zero();  // about the tool's centre of mass, in the axes of the last link
  Pose X_nS_ = Pose::Identity();      // the poses of S and (below) T in the last link
  Pose X_nT_ = Pose::Identity();
  Vec3 gravity_W_ = Vec3::Zero();
  JointVector lower_rad_, upper_rad_, start_rad_, rotor_inertia_, gear_stiffness_;
  std::array<bool, max_axes> slides_{};  // in the order of the drives
};

// Returns the pose of a description: the rotation Rz(yaw) Ry(pitch) Rx(roll) and the position.
Pose to_pose(const description::PoseDescription& description) noexcept;

}  // namespace proxarm::models
