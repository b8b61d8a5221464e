// An obstacle that moves: by a script, or driven from outside.
//
// The previous proxy point is carried by the object's own motion before it is used as q(k−1): in the object's frame it
// is X(t − T)⁻¹ q, and p is X(t)⁻¹ p. Everything else happens in that frame, where the object stands still: so friction
// acts against the relative motion, and an object can sweep onto a resting proxy. Across an elastic or a rigid surface
// alike.
#pragma once

#include <memory>
#include <numbers>

#include "models/obstacle.hpp"

namespace proxarm::models {

// Where a script takes an object, relative to where it was described: turned about a point, shifted, swung.
//   x(t) = c + R(ω t) (x − c) + v t + a sin(2π f t + φ)
struct ScriptedMotion {
  Vec3 velocity_m_per_s = Vec3::Zero();
  Vec3 amplitude_m = Vec3::Zero();
  double frequency_Hz = 0.0;
  double phase_rad = 0.0;
  Vec3 axis = Vec3::UnitZ();  // unit
  Vec3 centre_m = Vec3::Zero();
  double turn_rad_per_s = 0.0;

  [[nodiscard]] Pose at(double time_s) const noexcept {
    Pose X = Pose::Identity();
    X.linear() = Eigen::AngleAxisd(turn_rad_per_s * time_s, axis).toRotationMatrix();
    X.translation() = centre_m - X.linear() * centre_m + velocity_m_per_s * time_s +
                      amplitude_m * std::sin(2.0 * std::numbers::pi * frequency_Hz * time_s + phase_rad);
    return X;
  }
};

class MovingObstacle final : public Obstacle {
 public:
  // `still`: the object as it would be if the motion were none.
  MovingObstacle(std::unique_ptr<Obstacle> still, const ScriptedMotion& motion)
      : still_(std::move(still)), motion_(motion), scripted_(true) {
    set_time(0.0, 0.0);
  }
  // Driven: stands at `start` until drive() is called.
  MovingObstacle(std::unique_ptr<Obstacle> still, const Pose& start)
      : still_(std::move(still)), now_(start), before_(start) {}

  // The pose for the step to come; that of the last call is where it comes from. Call it once before each step.
  void drive(const Pose& X) noexcept {
    before_ = now_;
    now_ = X;
  }

  void set_time(double time_s, double period_s) noexcept override {
    if (!scripted_) return;
    now_ = motion_.at(time_s);
    before_ = motion_.at(time_s - period_s);
  }

  [[nodiscard]] Step step(double K, const Vec3& p, const Vec3& q) const noexcept override {
    const Vec3 q_O = before_.inverse(Eigen::Isometry) * q;
    Step s = still_->step(K, now_.inverse(Eigen::Isometry) * p, q_O);
    s.normal = now_.linear() * s.normal;
    s.r = !s.touches ? p : (rests() && s.r == q_O) ? q : Vec3(now_ * s.r);
    return s;
  }

  // q as World passes it: carried already.
  [[nodiscard]] bool excludes(const Vec3& q, const Vec3& r) const noexcept override {
    const Pose inverse = now_.inverse(Eigen::Isometry);
    return still_->excludes(inverse * q, inverse * r);
  }
  [[nodiscard]] Vec3 detour(const Vec3& p, const Vec3& q) const noexcept override {
    const Pose inverse = now_.inverse(Eigen::Isometry);
    const Vec3 q_O = before_.inverse(Eigen::Isometry) * q, w = still_->detour(inverse * p, q_O);
    return w == q_O ? q : Vec3(now_ * w);
  }
  [[nodiscard]] Tangent tangent(const Vec3& r, std::int32_t feature) const noexcept override {
    const Tangent t = still_->tangent(now_.inverse(Eigen::Isometry) * r, feature);
    return {FlatSurface<3>::of_unit(now_ * t.surface.point(), now_.linear() * t.surface.normal()), t.mu};
  }
  [[nodiscard]] double distance(const Vec3& x) const noexcept override {
    return still_->distance(now_.inverse(Eigen::Isometry) * x);
  }
  [[nodiscard]] Bounds bounds() const noexcept override { return {}; }
  [[nodiscard]] Vec3 carry(const Vec3& q) const noexcept override {
    return rests() ? q : Vec3(now_ * (before_.inverse(Eigen::Isometry) * q));
  }
  [[nodiscard]] bool moves() const noexcept override { return true; }
  void set_friction(double friction) noexcept override { still_->set_friction(friction); }

 private:
  [[nodiscard]] bool rests() const noexcept { return now_.matrix() == before_.matrix(); }

  std::unique_ptr<Obstacle> still_;
  ScriptedMotion motion_;
  bool scripted_ = false;
  Pose now_ = Pose::Identity();
  Pose before_ = Pose::Identity();
};

}  // namespace proxarm::models
