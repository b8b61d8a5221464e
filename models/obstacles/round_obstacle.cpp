#include "models/obstacles/round_obstacle.hpp"

namespace proxarm::models {

template <typename Core>
typename RoundObstacle<Core>::Step RoundObstacle<Core>::step(double K, const Vec3& p, const Vec3& q) const noexcept {
  const At at_p = at(core_, p, q);
  if (!(at_p.height < 0.0) && !(sign_ > 0.0 && passes(q, p))) return {p, at_p.normal, 0, false, false};

  if (!(mu_ > 0.0) && at_p.height < 0.0) {
    const Trial trial = place(K, p, at_p);
    return {trial.r, trial.normal, 0, true, false};
  }
  const At at_q = at(core_, q, p);
  const double q_rounding = rounding(q);
  // Tries s = 0: the proxy sticks at q, or at the surface point below q.
  Trial trial = stick(K, p, q, at_q, q_rounding);
  if (!(trial.excess > 0.0) && trial.f_n >= 0.0) return {trial.r, trial.normal, 0, true, false};
  if (!(at_p.height < 0.0)) return {p, at_p.normal, 0, false, false};  // the proxy goes around a solid
  return slide(K, p, q, trial.excess);
}

template <typename Core>
typename RoundObstacle<Core>::Step RoundObstacle<Core>::slide(double K, const Vec3& p, const Vec3& q,
                                                              double excess_at_q) const noexcept {
  const Vec3 way = p - q;
  const double s_0 = core_.closest_on_way(q, way);
  const Vec3 o = q + s_0 * way, q_o = q - o, p_o = p - o;
  const Core core = core_.seen_from(o);
  // If the distance of the path from the core is less than a sixteenth of a unit in the last place, rounding would
  // decide for each t on which side of the core r turns. `aside` chooses this side once for all t.
  const double length = way.norm(), closest = core.nearest(Vec3::Zero()).norm(), least = rounding(q) / 256.0;
  const Vec3 across = way.cross(at(core, p_o, q_o).normal);
  const Vec3 aside = closest < least && across.norm() > 0.0 ? Vec3(least * across.normalized()) : Vec3(Vec3::Zero());
  const auto try_at = [&](double t) { return place(K, p_o, at(core, t * way + aside, q_o)); };
  const double sigma = std::max(closest, least) / length, small = 0.25 * rounding(p);
  double low = -s_0, high = 1.0 - s_0, last = low, last_excess = excess_at_q, t = high;
  Trial trial = try_at(t);
  for (int k = 0; k < 100; ++k) {
    double next = t - trial.excess * (t - last) / (trial.excess - last_excess);
    if ((k > 4 && k % 2 == 1) || !(next > low && next < high)) {
      next = sigma * std::sinh(0.5 * (std::asinh(low / sigma) + std::asinh(high / sigma)));
    }
    if (!(next > low && next < high)) next = 0.5 * (low + high);
    if (!(next > low && next < high)) break;
    last = t;
    last_excess = trial.excess;
    t = next;
    trial = try_at(t);
    if (std::abs(trial.excess) <= small) break;
    (trial.excess < 0.0 ? high : low) = t;
  }
  if (trial.excess > small) trial = try_at(high);
  const Vec3 motion = trial.r - q_o;
  const bool slips = (motion - trial.normal * trial.normal.dot(motion)).norm() > rounding(q);
  return {o + trial.r, trial.normal, 0, true, slips};
}

template class RoundObstacle<PointCore>;
template class RoundObstacle<SegmentCore>;
template class RoundObstacle<LineCore>;

}  // namespace proxarm::models
