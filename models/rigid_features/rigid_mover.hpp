// An object that moves while a rigid tool touches it: its place at q(k−1), its place at q(k), and the motion between
// them.
//
// A step may be taken in parts. The object then goes from the first place to the second at constant speed: its centre
// moves along a straight line, and the object turns about its centre. The first and last place are equal to the given
// ones to the bit.
#pragma once

#include "models/geometry/geometric_algorithm.hpp"
#include "models/geometry/scripted_motion.hpp"
#include "models/geometry/tool_pose.hpp"

namespace proxarm::models {

// The pose of an object's frame in W.
struct Placement {
  Mat3 R = Mat3::Identity();
  Vec3 x = Vec3::Zero();

  [[nodiscard]] Vec3 operator*(const Vec3& p) const noexcept { return R * p + x; }
  [[nodiscard]] Vec3 back(const Vec3& p_W) const noexcept { return R.transpose() * (p_W - x); }
  [[nodiscard]] ToolPose operator*(const ToolPose& q) const noexcept {
    return {*this * q.position, (Quaternion(R) * q.orientation).normalized()};
  }
  [[nodiscard]] ToolPose back(const ToolPose& q_W) const noexcept {
    return {back(q_W.position), (Quaternion(R).conjugate() * q_W.orientation).normalized()};
  }
};

class RigidMover {
 public:
  explicit RigidMover(const ScriptedMotion& script);
  // A driven object stays in its described place until drive() is called. `centre`: roughly the object's middle in that
  // place; the object turns about it.
  explicit RigidMover(const Vec3& centre) : centre_(centre) {}

  // Begins a step of a scripted object, from its place one period before the given time to its place at that time. Does
  // nothing for a driven object.
  void set_time(const StepTime& time) noexcept;
  // Begins a step of a driven object, from its present place to the place X. X is relative to the object's described
  // place. Does nothing for a scripted object.
  void drive(const Pose& X) noexcept;
  [[nodiscard]] bool driven() const noexcept { return !scripted_; }

  // Puts the object to a share of the step's motion: 0 is its place at q(k−1), 1 its place at q(k).
  void go(double share) noexcept;
  // Ends the step. If the next step begins without set_time() or drive(), the object rests in it.
  void arrive() noexcept;

  [[nodiscard]] const Placement& at() const noexcept { return at_; }
  [[nodiscard]] const Placement& was() const noexcept { return was_; }
  [[nodiscard]] const Placement& is() const noexcept { return is_; }
  [[nodiscard]] bool rests() const noexcept { return rests_; }  // the object doesn't move in this step
  // Returns the present place, in W, of a point that was at x at the step's beginning and moves with the object.
  [[nodiscard]] Vec3 carried(const Vec3& x) const noexcept { return rests_ ? x : at_ * was_.back(x); }

  // Returns how far a point that rests in W, within `around` of x, moves at most in the whole step as seen from the
  // object, m.
  [[nodiscard]] double way_m(const Vec3& x, double around) const noexcept;
  // Returns the sum of the absolute coordinates of the object's position, m. The rounding of points on the object grows
  // with it.
  [[nodiscard]] double size_m() const noexcept { return at_.x.lpNorm<1>(); }

 private:
  static Placement placed(const Pose& X) noexcept { return {X.linear(), X.translation()}; }
  void go_from(const Placement& was, const Placement& is) noexcept;

  ScriptedMotion script_;
  bool scripted_ = false;
  Vec3 centre_ = Vec3::Zero();  // the point about which the object turns, in the object's frame
  Placement was_, is_, at_;
  // motion of the centre in the step, m; rotation vector of the step, rad
  Vec3 shift_ = Vec3::Zero(), turn_ = Vec3::Zero();
  bool rests_ = true;
  double time_s_ = 0.0;
};

}  // namespace proxarm::models
