#include "models/rigid_features/rigid_mover.hpp"

namespace proxarm::models {

RigidMover::RigidMover(const ScriptedMotion& script) : script_(script), scripted_(true), centre_(script.centre_m) {
  const Placement start = placed(script_.at(0.0));
  go_from(start, start);
}

void RigidMover::set_time(const StepTime& time) noexcept {
  if (!scripted_ || time.time_s == time_s_) return;
  const bool next = follows(time.time_s, time.period_s, time_s_);
  time_s_ = time.time_s;
  const Placement was = next ? is_ : placed(script_.at(time.time_s - time.period_s));
  go_from(was, placed(script_.at(time.time_s)));
}

void RigidMover::drive(const Pose& X) noexcept {
  if (!scripted_) go_from(is_, placed(orthonormalised(X)));
}

void RigidMover::go_from(const Placement& was, const Placement& is) noexcept {
  was_ = at_ = was;
  is_ = is;
  shift_ = is_ * centre_ - was_ * centre_;
  turn_.setZero();
  if (is_.R != was_.R) turn_ = rotation_vector(Quaternion(Mat3(is_.R * was_.R.transpose())).normalized());
  rests_ = is_.R == was_.R && is_.x == was_.x;
}

void RigidMover::go(double share) noexcept {
  if (share <= 0.0 || rests_) {
    at_ = was_;
  } else if (share >= 1.0) {
    at_ = is_;
  } else {
    const Vec3 centre = was_ * centre_ + share * shift_;
    if (is_.R != was_.R) at_.R = rotation_by(Vec3(share * turn_)).toRotationMatrix() * was_.R;
    at_.x = centre - at_.R * centre_;
  }
}

void RigidMover::arrive() noexcept {
  was_ = at_ = is_;
  rests_ = true;
  shift_.setZero();
  turn_.setZero();
}

// In the object's frame, Rᵀ(y − c) leads from the centre c to a point y that rests in W. Its change is bounded by the
// motion of c and by the turn times the distance.
double RigidMover::way_m(const Vec3& x, double around) const noexcept {
  if (rests_) return 0.0;
  const double turn = turn_.norm();
  return turn == 0.0 ? shift_.norm() : shift_.norm() + turn * ((x - was_ * centre_).norm() + around);
}

}  // namespace proxarm::models
