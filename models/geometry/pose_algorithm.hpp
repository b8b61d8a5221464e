// 𝒢 for a rigid tool: the geometric rule for a pose instead of a point.
//
//   q(k) = 𝒢(K, p̂(k), q(k−1)),   w(k) = K (q(k) ⊟ p̂(k))
//
// K is symmetric and positive definite, 6 × 6 (N/m, N, Nm/rad), at the tool's reference point; w is the wrench (force,
// torque about the reference point, in W) that the world exerts on the tool. With (26) on SE(3), K is diag(M, J)/T² +
// B/T + K_v, and p̂ is the pose that the tool would reach freely. The step is that of Moreau and Jean, at the level of
// positions:
//
//   w = Σ (f_i, (x_i − x) × f_i)        over the contacts at points x_i; x is the reference point
//   gap_i ≥ 0, n_iᵀ f_i ≥ 0, n_iᵀ f_i gap_i = 0
//   ‖f_t‖ ≤ μ f_n
//   f_t = −μ f_n s_t/‖s_t‖              if s_t = N_i N_iᵀ s_i ≠ 0, where s_i is the displacement of the tool's
//                                       material point since q(k−1), relative to the object
//
// Points, normals and gaps are taken at q(k).
//
// Assumption 1: if r = 𝒢(K, r ⊟ K⁻¹w, q) for one such K, then for all of them. Here r ⊟ K⁻¹w stands for
// moved(r, −K⁻¹w).
#pragma once

#include <memory>
#include <span>

#include "models/geometry/geometric_algorithm.hpp"
#include "models/geometry/small_matrix.hpp"
#include "models/geometry/tool_pose.hpp"

namespace proxarm::models {

// A place where the tool touched an object in the last step, pressing or not.
struct PoseContact {
  std::int32_t object = 0;       // index in the scene
  std::int32_t part = 0;         // index of the tool's part
  std::int32_t feature = 0;      // the object's face, edge or vertex
  bool slips = false;            // the tool's material point moves along the surface
  Vec3 point_W = Vec3::Zero();   // the tool's material point
  Vec3 normal_W = Vec3::Zero();  // unit, out of the object
  Vec3 force_W = Vec3::Zero();   // on the tool, N. If more than six rows hold the tool, only the sum of wrenches is
                                 // unique
  double gap_m = 0.0;
  double friction = 0.0;  // μ between tool and object
};

// Calls neither allocate, lock nor throw. A call may remember where the tool was, so each proxy needs a separate
// instance; a proxy that looks ahead steps a clone.
class PoseAlgorithm {
 public:
  PoseAlgorithm() = default;
  virtual ~PoseAlgorithm() = default;

  // 𝒢(K, p̂, q). Precondition: K is symmetric and positive definite, both poses are finite with unit quaternions, and
  // the tool at q is outside of all objects. The returned reference is valid until the next call.
  virtual const ToolPose& step(const Mat6& K, const ToolPose& p_hat, const ToolPose& q) noexcept = 0;

  // Call it before each step of a world that moves.
  virtual void set_time(const StepTime& /*time*/) noexcept {}
  [[nodiscard]] virtual bool wants_time() const noexcept { return true; }

  // Sets an object's friction from the next step on; `object` is its index in the scene. Precondition: finite and not
  // negative.
  virtual void set_friction(std::int32_t /*object*/, double /*friction*/) noexcept {}
  // Moves a driven object to X within the next step, relative to its described place; `object` is its index in the
  // scene. Call it once before each step in which the object moves.
  virtual void drive(std::int32_t /*object*/, const Pose& /*X*/) noexcept {}

  // The tool's contacts after the last step; empty in free motion. Valid until the next call.
  [[nodiscard]] virtual std::span<const PoseContact> contacts() const noexcept { return {}; }

  // Flags of the last step. Unresolved: no solution keeps all laws, and one law was given up. (If several solutions
  // keep them, such as for a wedged peg or Painlevé's rod, one is chosen without a flag.) Squeezed: for lack of room,
  // the tool is inside a moving object.
  [[nodiscard]] virtual bool unresolved() const noexcept { return false; }
  [[nodiscard]] virtual bool squeezed() const noexcept { return false; }

  // The smallest signed gap between tool and objects at a pose, metres; infinite in an empty world. Moving objects are
  // where they were in the last step. Not for the cycle.
  [[nodiscard]] virtual double clearance_m(const ToolPose& pose) const noexcept = 0;
  // The same with scripted objects at their places at time_s; driven objects are left out.
  [[nodiscard]] virtual double clearance_at_m(const ToolPose& pose, double /*time_s*/) const noexcept {
    return clearance_m(pose);
  }

  // A copy in the same state. Allocates.
  [[nodiscard]] virtual std::unique_ptr<PoseAlgorithm> clone() const = 0;
  // Copies the state of another instance, without allocating. Precondition: one of the two is a clone of the other.
  virtual void copy_state(const PoseAlgorithm& other) noexcept = 0;

 protected:
  PoseAlgorithm(const PoseAlgorithm&) = default;
  PoseAlgorithm& operator=(const PoseAlgorithm&) = default;
};

// A world without objects.
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
