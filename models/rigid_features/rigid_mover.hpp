// An object that moves while a rigid tool touches it: where it was at q(k−1), where it is at q(k), and the way between.
//
// A step may be taken in parts. The object then goes from one place to the other at a steady pace: its centre straight
// ahead, and it turns about that. Both ends are the given ones, bit for bit.
#pragma once

#include "models/geometry/geometric_algorithm.hpp"
#include "models/geometry/scripted_motion.hpp"
#include "models/geometry/tool_pose.hpp"

namespace proxarm::models {

// Of a frame in W.
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
  // Driven: it stands where it was described until drive() is called. `centre` is about where it is then.
  explicit RigidMover(const Vec3& centre) : centre_(centre) {}

  // A scripted object's place at this time; from where it was a period ago. Of a driven one: nothing.
  void set_time(const StepTime& time) noexcept;
  // Relative to where it was described. Of a scripted object: nothing.
  void drive(const Pose& X) noexcept;
  [[nodiscard]] bool driven() const noexcept { return !scripted_; }

  // To a share of the step's way: 0 is where the object was, 1 where it is.
  void go(double share) noexcept;
  // The step is over. Another one without set_time() or drive() finds the object at rest.
  void arrive() noexcept;

  [[nodiscard]] const Placement& at() const noexcept { return at_; }
  [[nodiscard]] const Placement& was() const noexcept { return was_; }
  [[nodiscard]] const Placement& is() const noexcept { return is_; }
  [[nodiscard]] bool rests() const noexcept { return rests_; }  // in this step
  // Where a point would be now that was at x at the step's beginning, and has moved with the object.
  [[nodiscard]] Vec3 carried(const Vec3& x) const noexcept { return rests_ ? x : at_ * was_.back(x); }

  // How far points come at most in all of the step, seen from the object, that stay within `around` of x in W.
  [[nodiscard]] double way_m(const Vec3& x, double around) const noexcept;
  // Of the coordinates that places are rounded in.
  [[nodiscard]] double size_m() const noexcept { return at_.x.lpNorm<1>(); }

 private:
  static Placement placed(const Pose& X) noexcept { return {X.linear(), X.translation()}; }
  void go_from(const Placement& was, const Placement& is) noexcept;

  ScriptedMotion script_;
  bool scripted_ = false;
  Vec3 centre_ = Vec3::Zero();  // in the object's frame: what it turns about
  Placement was_, is_, at_;
  Vec3 shift_ = Vec3::Zero(), turn_ = Vec3::Zero();  // of the centre; rad
  bool rests_ = true;
  double time_s_ = 0.0;
};

}  // namespace proxarm::models
