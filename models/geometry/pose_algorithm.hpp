// 𝒢 for a rigid tool: the geometric rule for a pose instead of a point.
//
//   q(k) = 𝒢(K, p̂(k), q(k−1)),   w(k) = K (q(k) ⊟ p̂(k))
//
// K is symmetric and positive definite, 6 × 6 (N/m, N, Nm/rad), at the tool's reference point; w is the wrench (force,
// torque about the reference point, in W) that the world exerts on the tool. With (26) on SE(3), K is
// diag(M, J)/T² + B/T + K_v and p̂ the pose that the tool would reach freely. It is a step of Moreau and Jean's at the
// level of positions:
//
//   w = Σ (f_i, (x_i − x) × f_i)        over the contacts, at points x_i, x being the reference point
//   gap_i ≥ 0, n_iᵀ f_i ≥ 0, n_iᵀ f_i gap_i = 0
//   ‖f_t‖ ≤ μ f_n; where the material point of the tool has moved along the surface since q(k−1), relative to the
//   object, f_t has the size μ f_n and points against that displacement N_i N_iᵀ s_i
//
// with points, normals and gaps taken at q(k).
//
// Assumption 1: if r = 𝒢(K, r ⊟ K⁻¹w, q) for one such K, then for all: (moved(r, −K⁻¹w) is what ⊟ a twist means here).
#pragma once

#include <memory>
#include <span>

#include "models/geometry/geometric_algorithm.hpp"
#include "models/geometry/small_matrix.hpp"
#include "models/geometry/tool_pose.hpp"

namespace proxarm::models {

// A place where tool and object touched in the last step, pressing or not.
struct PoseContact {
  std::int32_t object = 0;       // index in the scene
  std::int32_t part = 0;         // of the tool
  std::int32_t feature = 0;      // of the object: face, edge or vertex
  bool slips = false;            // the tool's material point moves along the surface
  Vec3 point_W = Vec3::Zero();   // the tool's material point
  Vec3 normal_W = Vec3::Zero();  // unit, out of the object
  Vec3 force_W = Vec3::Zero();   // on the tool, N. Where more than six rows hold it, only the sum of wrenches is unique
  double gap_m = 0.0;
  double friction = 0.0;  // μ between the two
};

// Calls neither allocate, lock nor throw. A call may remember where the tool was, so each proxy needs one of its own; a
// proxy that looks ahead steps a clone.
class PoseAlgorithm {
 public:
  PoseAlgorithm() = default;
  virtual ~PoseAlgorithm() = default;

  // 𝒢(K, p̂, q). Preconditions: K symmetric and positive definite, both poses finite with unit quaternions, and the tool
  // outside of everything at q. The reference holds until the next call.
  virtual const ToolPose& step(const Mat6& K, const ToolPose& p_hat, const ToolPose& q) noexcept = 0;

  // To be called before each step of a world that moves.
  virtual void set_time(const StepTime& /*time*/) noexcept {}
  [[nodiscard]] virtual bool wants_time() const noexcept { return true; }

  // From the next step on, of an object by its index in the scene. Precondition: finite and not negative.
  virtual void set_friction(std::int32_t /*object*/, double /*friction*/) noexcept {}
  // Where a driven object is from the next step on, relative to where it was described, by its index in the scene; it
  // moves there within that step. To be called once before each step in which it moves.
  virtual void drive(std::int32_t /*object*/, const Pose& /*X*/) noexcept {}

  // Where the tool touches after the last step (empty: free). Valid until the next call.
  [[nodiscard]] virtual std::span<const PoseContact> contacts() const noexcept { return {}; }

  // Flags of the last step. Unresolved: no solution was found that keeps all laws, and one was given up. Where the laws
  // allow several (a wedged peg, Painlevé's rod) one is chosen, and nothing tells. Squeezed: objects that move leave
  // the tool no room, and it is inside of one.
  [[nodiscard]] virtual bool unresolved() const noexcept { return false; }
  [[nodiscard]] virtual bool squeezed() const noexcept { return false; }

  // The smallest signed gap between tool and objects at a pose, metres; infinite if there is nothing. Objects that move
  // are where they were in the last step. Not for the cycle.
  [[nodiscard]] virtual double clearance_m(const ToolPose& pose) const noexcept = 0;
  // The same with scripted objects where they are at time_s; driven ones are left out.
  [[nodiscard]] virtual double clearance_at_m(const ToolPose& pose, double /*time_s*/) const noexcept {
    return clearance_m(pose);
  }

  // Another one in the same state. Allocates.
  [[nodiscard]] virtual std::unique_ptr<PoseAlgorithm> clone() const = 0;
  // Takes over the state of another one of the same world, without allocating. Precondition: it is a clone of this one,
  // or this one of it.
  virtual void copy_state(const PoseAlgorithm& other) noexcept = 0;

 protected:
  PoseAlgorithm(const PoseAlgorithm&) = default;
  PoseAlgorithm& operator=(const PoseAlgorithm&) = default;
};

// Nothing to touch.
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
