#include "models/obstacles/moving_obstacle.hpp"

#include <cmath>

namespace proxarm::models {

void MovingObstacle::go_from(const Pose& before) noexcept {
  rests_ = now_.matrix() == before.matrix();
  now_inverse_ = now_.inverse(Eigen::Isometry);
  before_inverse_ = before.inverse(Eigen::Isometry);
  shortened_ = false;
  // The size is at least a metre, and is rounded up to a power of two so that it rarely changes. This matters because a
  // mesh forgets its warm start at each change.
  const double size = std::max({1.0, now_.translation().lpNorm<1>(), before.translation().lpNorm<1>()});
  if (std::isfinite(size)) still_->set_rounding_size(std::ldexp(1.0, std::ilogb(size) + 1));
}

void MovingObstacle::set_time(double time_s, double period_s) noexcept {
  if (time_s != time_s_) {
    last_ = now_;
    last_time_s_ = time_s_;
    time_s_ = time_s;
    whole_period_s_ = period_s;
    if (scripted_) now_ = motion_.at(time_s);
  }
  const bool shorter = period_s < whole_period_s_;
  if (!shorter) whole_period_s_ = period_s;
  if (scripted_) {
    const bool as_before = follows(time_s, period_s, last_time_s_);
    go_from(!(period_s > 0.0) ? now_ : as_before ? last_ : motion_.at(time_s - period_s));
  } else if (shorter) {
    Pose before = now_;
    const double share = period_s / whole_period_s_;
    before.translation() += share * (driven_from_.translation() - now_.translation());
    if (driven_from_.linear() != now_.linear()) {
      const Eigen::Quaterniond there(now_.linear()), back(driven_from_.linear());
      before.linear() = there.slerp(share, back).toRotationMatrix();
    }
    go_from(before);
  } else if (shortened_) {
    go_from(driven_from_);
  }
  shortened_ = shorter;
}

// Returns q in the object's frame, carried along by the object's motion. At order 2, a second call in a step starts at
// q̃ = q₁ + (q₁ − q₂)/3 with the period 2T/3. If the object's motion isn't uniform, q̃ may be behind a mesh. The result
// is then the point that a step from q₁ towards q̃ reaches.
Vec3 MovingObstacle::from(const Vec3& q) const noexcept {
  const Vec3 q_O = before_inverse_ * q;
  if (!shortened_) {
    whole_from_ = q_O;
    return q_O;
  }
  Vec3 normal;
  return still_->parts(whole_from_, q_O, normal) ? still_->step(1.0, q_O, whole_from_).r : q_O;
}

// Returns a touched point in W. If the proxy sticks to a resting object, the result is q, bit for bit.
Vec3 MovingObstacle::to_W(const Vec3& r_O, const Vec3& q_O, const Vec3& q) const noexcept {
  if (rests_ && r_O == q_O) return q;
  Vec3 r = now_ * r_O, moved = r_O, normal;
  // The next step transforms r back to the object's frame, with rounding. If r_O is within rounding of an untouched
  // face (beside a vertex, deep in a spike), the transformed r may be behind that face. Then r is moved away from that
  // face, by a greater distance with each try. The 24 tries move r by up to 8190 times the first distance.
  double away = 16.0 * std::numeric_limits<double>::epsilon() * (r.lpNorm<1>() + now_.translation().lpNorm<1>());
  for (int k = 0; k < 24 && still_->parts(r_O, now_inverse_ * r, normal); ++k) {
    moved += away * normal;
    if (k % 2 == 1) away *= 2.0;
    r = now_ * moved;
  }
  return r;
}

std::size_t MovingObstacle::contacts(double K, const Vec3& p, const Vec3& q, const Step& s,
                                     std::array<Contact<3>, 3>& out) const noexcept {
  Step in_O = s;
  in_O.normal = now_.linear().transpose() * s.normal;
  const std::size_t count = still_->contacts(K, now_inverse_ * p, from(q), in_O, out);
  for (std::size_t k = 0; k < count; ++k) out[k].normal = count == 1 ? s.normal : Vec3(now_.linear() * out[k].normal);
  return count;
}

}  // namespace proxarm::models
