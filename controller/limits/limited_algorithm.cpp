#include "controller/limits/limited_algorithm.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace proxarm::controller {

template <int N>
void LimitedAlgorithm<N>::set_limits(const StepLimits& limits, const Eigen::Matrix<double, 3, N>& basis,
                                     const V& q_k1) noexcept {
  sets_.set(limits, basis);
  q_k1_ = q_k1;
}

template <int N>
auto LimitedAlgorithm<N>::operator()(double K, const V& p, const V& q) noexcept -> V {
  const V start = from(q);
  V r = (*inner_)(K, p, start);
  squeezed_ = inner_->squeezed();
  active_ = {};
  soft_met_ = true;
  limit_shift_ = V::Zero();
  gave_way_ = false;
  if (!sets_.contains(r - q_k1_, tolerance_m, true) || !sets_.followed(r - q_k1_, r)) r = solve(K, p, start, r);
  gather_contacts();
  return r;
}

template <int N>
auto LimitedAlgorithm<N>::solve(double K, const V& p, const V& q, const V& free) noexcept -> V {
  Step step{K, p, q};
  Try now = at(step, V::Zero(), free);
  if (!sets_.contains(now.l.x, 1e-9, true)) {
    step.with_soft = soft_met_ = false;
    now = at(step, V::Zero(), free);
  }
  double gap_before = -1.0;
  int stuck = 0;
  for (int turn = 0; turn < most_turns; ++turn) {
    if (const bool seldom = (turn & (turn - 1)) == 0; turn > 0 && seldom) {
      Try other = now;
      Joined joined = join(step, other, turn == 1 ? few_joins : most_joins);
      if (joined == Joined::unsettled && jump(step, other)) joined = Joined::settled;
      if (joined == Joined::settled) return take(other);
    }
    now = at(step, now.shift - now.gap);
    const double gap = now.gap.norm();
    if (gap <= tolerance_m) return take(now);
    // If the gap no longer shrinks, contacts and limits have no common point.
    stuck = std::abs(gap - gap_before) <= 1e-3 * gap ? stuck + 1 : 0;
    if (stuck >= 3 || (!now.l.exact && step.sweeps <= 0)) break;
    gap_before = gap;
  }
  return give_way(step, now);
}

template <int N>
auto LimitedAlgorithm<N>::join(Step& step, Try& now, int most) noexcept -> Joined {
  for (int k = 0; k < most; ++k) {
    for (const models::Contact<N>& contact : inner_->contacts()) sets_.add_wall(now.r - q_k1_, contact.normal);
    const V friction = across_contacts(now.r - step.p - now.shift);
    const auto both = sets_.nearest(step.p + friction - q_k1_, step.with_soft, step.sweeps);
    sets_.clear_walls();
    if (!both.exact) return Joined::apart;
    now = at(step, both.shift);
    if (now.gap.norm() <= tolerance_m) return Joined::settled;
  }
  return Joined::unsettled;
}

template <int N>
auto LimitedAlgorithm<N>::across_contacts(V force) const noexcept -> V {
  std::array<V, N> e;
  e.fill(V::Zero());
  std::size_t count = 0;
  for (const models::Contact<N>& contact : inner_->contacts()) {
    V rest = contact.normal;
    for (std::size_t i = 0; i < count; ++i) rest -= e[i].dot(rest) * e[i];
    const double length = rest.norm();
    if (count < N && length > 1e-9) e[count++] = rest / length;
  }
  for (std::size_t i = 0; i < count; ++i) force -= e[i].dot(force) * e[i];
  return force;
}

template <int N>
bool LimitedAlgorithm<N>::jump(Step& step, Try& now) noexcept {
  for (int k = 0; k < most_jumps && now.l.exact; ++k) {
    Eigen::Matrix<double, N, N> J;
    for (int i = 0; i < N; ++i) {
      const V nudged = now.shift + nudge_m * V::Unit(i);
      const V R_i = ((*inner_)(step.K, step.p + nudged, step.q) - now.r) / nudge_m;
      J.col(i) = R_i - now.l.derivative(R_i - V::Unit(i));
    }
    V ds = J.fullPivLu().solve(-now.gap);
    if (!ds.allFinite()) return false;
    // The size of the present forces (over κ) bounds ds, since J is nearly singular when 𝒢 sticks or jams.
    const double most = (now.r - step.p).norm(), length = ds.norm();
    if (length > most) ds *= most / length;
    now = at(step, now.shift + ds);
    if (now.gap.norm() <= tolerance_m) return true;
  }
  return false;
}

template <int N>
auto LimitedAlgorithm<N>::take(const Try& solution) noexcept -> V {
  limit_shift_ = solution.shift;
  active_ = solution.l.active;
  return solution.r;
}

template <int N>
auto LimitedAlgorithm<N>::give_way(Step& step, const Try& last) noexcept -> V {
  active_ = last.l.active;
  give_way_at(last.r);
  const V held = last.r - step.p - last.shift;  // the contacts' force divided by κ
  V l;
  if (sets_.contains(V::Zero(), tolerance_m, step.with_soft)) {
    l = sets_.draw_back(last.r - q_k1_, step.with_soft);
  } else {
    step.sweeps = std::max(step.sweeps, most_sweeps / 4);
    const auto nearest = sets_.nearest(step.p + held - q_k1_, step.with_soft, step.sweeps);
    active_ = nearest.active;
    l = sets_.contains(nearest.x, 1e-10, false) ? nearest.x : sets_.draw_back(nearest.x, false);
  }
  limit_shift_ = l + q_k1_ - step.p - held;
  return q_k1_ + l;
}

template <int N>
void LimitedAlgorithm<N>::gather_contacts() noexcept {
  count_ = 0;
  for (const models::Contact<N>& contact : inner_->contacts()) {
    if (count_ + 1 == contacts_.size()) break;
    contacts_[count_++] = contact;
  }
  if (active_.kinds == 0) return;
  const double length = limit_shift_.norm();
  contacts_[count_++] = {limit_object, active_.kinds, false, length > 0.0 ? V(limit_shift_ / length) : V(V::Zero())};
}

template class LimitedAlgorithm<1>;
template class LimitedAlgorithm<2>;
template class LimitedAlgorithm<3>;

}  // namespace proxarm::controller
