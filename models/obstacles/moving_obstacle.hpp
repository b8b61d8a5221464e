// An obstacle that moves by a script or is driven from outside.
//
// The step happens in the object's frame, where the object stands still. q there is X(t − T)⁻¹ q, carried along by the
// object's motion, and p is X(t)⁻¹ p. So friction acts against the relative motion, and the object can sweep onto a
// resting proxy, with rigid surfaces and elastic layers alike.
//
// A mesh can't push back a proxy that got behind a face, so rounding between its frame and W must never take the proxy
// through one. The touched surface is in front of the faces by more than this rounding (Obstacle::set_rounding_size). A
// point in W is returned only after a test of its image in the object's frame. And each step starts, bit for bit, from
// the pose at which the last step ended.
#pragma once

#include <memory>

#include "models/geometry/scripted_motion.hpp"
#include "models/obstacles/obstacle.hpp"

namespace proxarm::models {

class MovingObstacle final : public Obstacle {
 public:
  // `still`: the object at the place where the scene describes it.
  MovingObstacle(std::unique_ptr<Obstacle> still, const ScriptedMotion& motion)
      : still_(std::move(still)), motion_(motion), scripted_(true) {
    last_ = now_ = motion_.at(0.0);
    go_from(now_);
  }
  // A driven object; it stands at `start` until drive() is called.
  MovingObstacle(std::unique_ptr<Obstacle> still, const Pose& start)
      : still_(std::move(still)), now_(orthonormalised(start)), driven_from_(now_) {
    go_from(now_);
  }

  // Sets the pose for the next step; the object moves there from the pose of the last call. Call it once before each
  // step. A rotation that isn't orthonormal within rounding is made so.
  void drive(const Pose& X) noexcept {
    driven_from_ = now_;
    now_ = orthonormalised(X);
    go_from(driven_from_);
  }

  // At order 2 it is called a second time for the same time, with a shorter period: see from().
  void set_time(double time_s, double period_s) noexcept override;

  [[nodiscard]] Step step(double K, const Vec3& p, const Vec3& q) const noexcept override {
    const Vec3 q_O = from(q);
    Step s = still_->step(K, now_inverse_ * p, q_O);
    s.r = s.touches ? to_W(s.r, q_O, q) : p;
    s.normal = now_.linear() * s.normal;
    return s;
  }
  [[nodiscard]] std::size_t contacts(double K, const Vec3& p, const Vec3& q, const Step& s,
                                     std::array<Contact<3>, 3>& out) const noexcept override;

  // Precondition: q has been carried along already; World does that.
  [[nodiscard]] bool excludes(const Vec3& q, const Vec3& r) const noexcept override {
    return still_->excludes(now_inverse_ * q, now_inverse_ * r);
  }
  [[nodiscard]] bool bars(const Vec3& x, const Vec3& y) const noexcept override {
    return still_->bars(now_inverse_ * x, now_inverse_ * y);
  }
  [[nodiscard]] Vec3 detour(const Vec3& p, const Vec3& q) const noexcept override {
    const Vec3 q_O = from(q), w = still_->detour(now_inverse_ * p, q_O);
    return w == q_O ? q : Vec3(now_ * w);
  }
  [[nodiscard]] Tangent tangent(const Vec3& r, std::int32_t feature) const noexcept override {
    const Tangent t = still_->tangent(now_inverse_ * r, feature);
    return {FlatSurface<3>::of_unit(now_ * t.surface.point(), now_.linear() * t.surface.normal()), t.mu};
  }
  [[nodiscard]] double distance(const Vec3& x) const noexcept override { return still_->distance(now_inverse_ * x); }
  [[nodiscard]] bool comes_within(const Vec3& x, double reach) const noexcept override {
    return still_->comes_within(now_inverse_ * x, reach);
  }
  bool parts(const Vec3& x, const Vec3& y, Vec3& normal) const noexcept override {
    if (!still_->parts(now_inverse_ * x, now_inverse_ * y, normal)) return false;
    normal = now_.linear() * normal;
    return true;
  }
  [[nodiscard]] Bounds bounds() const noexcept override { return {}; }
  [[nodiscard]] Vec3 carry(const Vec3& q) const noexcept override {
    const Vec3 q_O = from(q);
    return rests_ && (!shortened_ || q_O == before_inverse_ * q) ? q : Vec3(now_ * q_O);
  }
  [[nodiscard]] bool moves() const noexcept override { return true; }
  void set_friction(double friction) noexcept override { still_->set_friction(friction); }
  [[nodiscard]] Layer layer() const noexcept override { return still_->layer(); }
  [[nodiscard]] bool presses_at(const Vec3& r) const noexcept override { return still_->presses_at(now_inverse_ * r); }

 private:
  void go_from(const Pose& before) noexcept;
  [[nodiscard]] Vec3 from(const Vec3& q) const noexcept;
  [[nodiscard]] Vec3 to_W(const Vec3& r_O, const Vec3& q_O, const Vec3& q) const noexcept;

  std::unique_ptr<Obstacle> still_;
  ScriptedMotion motion_;
  bool scripted_ = false;
  Pose now_ = Pose::Identity();
  Pose now_inverse_ = Pose::Identity(), before_inverse_ = Pose::Identity();
  bool rests_ = true;  // both poses are equal
  // The pose before this step: a scripted object's at the last time, a driven object's at the last call of drive().
  Pose last_ = Pose::Identity(), driven_from_ = Pose::Identity();
  double time_s_ = 0.0, last_time_s_ = 0.0;
  double whole_period_s_ = 0.0;
  bool shortened_ = false;
  mutable Vec3 whole_from_ = Vec3::Zero();  // last result of from() for a whole period
};

}  // namespace proxarm::models
