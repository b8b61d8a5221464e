// An obstacle that moves by a script, or that is driven from outside.
//
// A step is made in the object's frame, in which the object stands still. In this frame q is X(t − T)⁻¹ q, because the
// object's motion carries q along, and p is X(t)⁻¹ p. So friction acts against the relative motion, and the object can
// move onto a resting proxy and push it. This is true for rigid surfaces and for elastic layers.
//
// A mesh can't push back a proxy that got behind a face. So rounding between the mesh's frame and W must never take the
// proxy through a face. Three rules prevent this:
// - The touched surface is in front of the faces by more than this rounding (Obstacle::set_rounding_size).
// - A point in W is returned only after a test of the same point, transformed back to the object's frame.
// - Each step starts, bit for bit, from the pose of the object at which the last step ended.
#pragma once

#include <memory>

#include "models/geometry/scripted_motion.hpp"
#include "models/obstacles/obstacle.hpp"

namespace proxarm::models {

class MovingObstacle final : public Obstacle {
 public:
  // A scripted object. `still`: the object at the pose that the scene describes.
  MovingObstacle(std::unique_ptr<Obstacle> still, const ScriptedMotion& motion)
      : still_(std::move(still)), motion_(motion), scripted_(true) {
    last_ = now_ = motion_.at(0.0);
    go_from(now_);
  }
  // A driven object. It stands at `start` until the first call of drive().
  MovingObstacle(std::unique_ptr<Obstacle> still, const Pose& start)
      : still_(std::move(still)), now_(orthonormalised(start)), driven_from_(now_) {
    go_from(now_);
  }

  // Sets the object's pose at the end of the next step. In this step the object moves from the pose of the last call to
  // this pose. Call it once before each step. A rotation that isn't orthonormal within rounding is orthonormalised.
  void drive(const Pose& X) noexcept {
    driven_from_ = now_;
    now_ = orthonormalised(X);
    go_from(driven_from_);
  }

  // At order 2 this is called twice for the same time; the second call has a shorter period. See from().
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

  // Precondition: q is already carried along by the object's motion; World calls carry() for this.
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
  bool rests_ = true;  // the pose before this step equals the pose after it
  // The pose before this step: for a scripted object the pose at the last time, for a driven object the pose at the
  // last call of drive().
  Pose last_ = Pose::Identity(), driven_from_ = Pose::Identity();
  double time_s_ = 0.0, last_time_s_ = 0.0;
  double whole_period_s_ = 0.0;
  bool shortened_ = false;
  mutable Vec3 whole_from_ = Vec3::Zero();  // the last result of from() for a step of the whole period
};

}  // namespace proxarm::models
