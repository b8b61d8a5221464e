// 𝒢 for a rigid tool: the geometric algorithm for a pose instead of a point.
//
//   q(k) = 𝒢(K, p̂(k), q(k−1)),   w(k) = K (q(k) ⊟ p̂(k))
//
// K is symmetric and positive definite, 6 × 6 (N/m, N, Nm/rad), at the tool's reference point. w is the wrench (force,
// and torque about the reference point, in W) that the world exerts on the tool. With (26) on SE(3), K is diag(M, J)/T²
// + B/T + K_v, and p̂ is the pose that the tool would reach without the world. A step obeys the law of Moreau and Jean,
// with positions instead of velocities:
//
//   w = Σ (f_i, (x_i − x) × f_i)        over the contacts at points x_i; x is the reference point
//   gap_i ≥ 0, n_iᵀ f_i ≥ 0, n_iᵀ f_i gap_i = 0
//   ‖f_t‖ ≤ μ f_n
//   f_t = −μ f_n s_t/‖s_t‖              if s_t = N_i N_iᵀ s_i ≠ 0, where s_i is the displacement of the tool's
//                                       material point since q(k−1), relative to the object
//
// Points, normals and gaps are taken at q(k).
//
// Assumption 1: if r = 𝒢(K, r ⊟ K⁻¹w, q) for one such K, then this equation holds for every such K. Here r ⊟ K⁻¹w means
// moved(r, −K⁻¹w).
#pragma once

#include <memory>
#include <span>

#include "models/geometry/geometric_algorithm.hpp"
#include "models/geometry/small_matrix.hpp"
#include "models/geometry/tool_pose.hpp"

namespace proxarm::models {

// A place where the tool touched an object in the last step, with or without force.
struct PoseContact {
  std::int32_t object = 0;       // index in the scene
  std::int32_t part = 0;         // index of the tool's part that touched
  std::int32_t feature = 0;      // the object's face, edge or vertex that was touched
  bool slips = false;            // the tool's material point moves along the surface
  Vec3 point_W = Vec3::Zero();   // the position of the tool's material point
  Vec3 normal_W = Vec3::Zero();  // unit, out of the object
  // The force on the tool, N. If more than six constraints hold the tool, the single forces aren't unique; the sum of
  // their wrenches is.
  Vec3 force_W = Vec3::Zero();
  double gap_m = 0.0;
  double friction = 0.0;  // μ between tool and object
};

// A 𝒢 for poses. Calls don't allocate, lock or throw. An instance may remember where the tool was, so each proxy needs
// a separate instance. A proxy that looks ahead steps a clone.
class PoseAlgorithm {
 public:
  PoseAlgorithm() = default;
  virtual ~PoseAlgorithm() = default;

  // Returns 𝒢(K, p̂, q). Precondition: K is symmetric and positive definite; p̂ and q are finite with unit quaternions;
  // the tool at q is outside all objects. The returned reference is valid until the next call.
  virtual const ToolPose& step(const Mat6& K, const ToolPose& p_hat, const ToolPose& q) noexcept = 0;

  // Sets the time of the next step. Call it before each step of a world that moves.
  virtual void set_time(const StepTime& /*time*/) noexcept {}
  [[nodiscard]] virtual bool wants_time() const noexcept { return true; }

  // Sets the friction of the object with this index in the scene, from the next step on. Precondition: `friction` is
  // finite and not negative.
  virtual void set_friction(std::int32_t /*object*/, double /*friction*/) noexcept {}
  // Moves the driven object with this index in the scene within the next step. X is the object's new pose, relative to
  // the pose that the scene describes. Call it once before each step in which the object moves.
  virtual void drive(std::int32_t /*object*/, const Pose& /*X*/) noexcept {}

  // Returns the tool's contacts after the last step; empty in free motion. Valid until the next call.
  [[nodiscard]] virtual std::span<const PoseContact> contacts() const noexcept { return {}; }

  // Whether, in the last step, no solution satisfied all laws, so that one law was given up. If several solutions
  // satisfy all laws, such as for a wedged peg or Painlevé's rod, one of these solutions is chosen and the step isn't
  // unresolved.
  [[nodiscard]] virtual bool unresolved() const noexcept { return false; }
  // Whether, in the last step, the tool had no room and is inside a moving object.
  [[nodiscard]] virtual bool squeezed() const noexcept { return false; }

  // Returns the smallest signed gap between tool and objects at a pose, metres; infinite in an empty world. Moving
  // objects are at their poses of the last step. Too slow for the cycle.
  [[nodiscard]] virtual double clearance_m(const ToolPose& pose) const noexcept = 0;
  // Returns the smallest signed gap with the scripted objects at their poses at time_s, and without the driven objects.
  [[nodiscard]] virtual double clearance_at_m(const ToolPose& pose, double /*time_s*/) const noexcept {
    return clearance_m(pose);
  }

  // Returns a copy in the same state. Allocates.
  [[nodiscard]] virtual std::unique_ptr<PoseAlgorithm> clone() const = 0;
  // Copies the state of another instance, without allocating. Precondition: one of the two instances is a clone of the
  // other instance.
  virtual void copy_state(const PoseAlgorithm& other) noexcept = 0;

 protected:
  PoseAlgorithm(const PoseAlgorithm&) = default;
  PoseAlgorithm& operator=(const PoseAlgorithm&) = default;
};

// The 𝒢 of a world without objects.
class FreePose final : public PoseAlgorithm {
 public:
  const ToolPose& step(const Mat6& /*K*/, const ToolPose& p_hat, const ToolPose& /*q*/) noexcept override {
    q_ = p_hat;
    return q_;
  }
  [[nodiscard]] bool wants_time() const noexcept override { return false; }
  [[nodiscard]] double clearance_m(const ToolPose& /*pose*/) const noexcept override {
    return std::numeric_limits<double>::infinity();
  }
  [[nodiscard]] std::unique_ptr<PoseAlgorithm> clone() const override { return std::make_unique<FreePose>(*this); }
  void copy_state(const PoseAlgorithm& /*other*/) noexcept override {}

 private:
  ToolPose q_;
};

}  // namespace proxarm::models
