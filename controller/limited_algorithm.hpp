// A 𝒢 that keeps within a step's limits: q(k) minimises ‖q − p̂‖ over contacts ∩ limits.
//
// Contacts answer a force λ of the limits with their own, friction included; limits answer with the point of theirs
// that is nearest to where the contacts' force leads:
//   r = 𝒢(κ, p̂ + λ/κ, q₁),   l = P(r − λ/κ),   to be found: λ with r = l
// λ = κ (l − (r − λ/κ)) is then in the limits' normal cone at r. Limits are normal cones and 𝒢 is K-independent, so the
// whole is. The step is taken as solved only where r = l holds within rounding, whichever of these finds it:
//   free      nothing touches: λ/κ = P(p̂) − p̂
//   joined    contacts as half-spaces among the limits, friction held: exact at once without friction on flat surfaces
//   Newton    on r(λ) − l(λ), as differences of 𝒢 and the active limits give its derivative: with friction, in media
//   in turn   λ/κ ← l − (r − λ/κ), block Gauss-Seidel, from where the others start again now and then
// Where no point is in both, the contacts give way and q is the limits' point that is nearest to what they allow; where
// the limits alone have no point in common, the soft ones (leash, power) give way.
//
// A step that no limit touches is the 𝒢's own to the bit. Neither allocates, locks nor throws.
#pragma once

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <span>

#include "controller/limit_sets.hpp"
#include "models/geometric_algorithm.hpp"

namespace proxarm::controller {

// Contacts of a limit report this as their object; what counts contacts of the scene skips it.
inline constexpr std::int32_t limit_object = -2;

template <int N>
class LimitedAlgorithm final : public models::GeometricAlgorithm<N> {
 public:
  using V = models::Vec<N>;

  // `inner` must outlive this.
  explicit LimitedAlgorithm(models::GeometricAlgorithm<N>& inner) : inner_(&inner) {}

  // Before each step: the sets around q₁ = q(k−1), the true one also where a second-order step starts from another
  // point.
  void set_limits(const StepLimits& limits, const Eigen::Matrix<double, 3, N>& basis, const V& q_k1) noexcept {
    sets_.set(limits, basis);
    q_k1_ = q_k1;
  }

  V operator()(double K, const V& p, const V& q) noexcept override {
    V r = (*inner_)(K, p, q);
    squeezed_ = inner_->squeezed();
    active_ = {};
    soft_met_ = true;
    limit_shift_ = V::Zero();
    if (!sets_.contains(r - q_k1_, tolerance_m, true)) r = solve(K, p, q, r);
    gather_contacts();
    return r;
  }

  void set_time(const models::StepTime& time) noexcept override { inner_->set_time(time); }
  [[nodiscard]] bool wants_time() const noexcept override { return inner_->wants_time(); }
  [[nodiscard]] std::span<const models::Contact<N>> contacts() const noexcept override {
    return {contacts_.data(), count_};
  }
  [[nodiscard]] std::uint64_t unresolved_steps() const noexcept override { return inner_->unresolved_steps(); }
  // By the contacts alone: what a limit leaves inside of an object has its flags.
  [[nodiscard]] bool squeezed() const noexcept override { return squeezed_; }

  // Of the last call. The limits' force on the proxy is κ times this.
  [[nodiscard]] const V& limit_shift() const noexcept { return limit_shift_; }
  [[nodiscard]] const ActiveLimits& active() const noexcept { return active_; }
  [[nodiscard]] bool soft_limits_met() const noexcept { return soft_met_; }

 private:
  static constexpr int most_turns = 300;
  static constexpr int few_joins = 3, most_joins = 10;  // with friction; without, one is enough
  static constexpr int most_jumps = 6;                  // where Newton gets there, two or three do
  static constexpr int most_sweeps = 3000;              // of a step in all, some 50 ns each
  static constexpr double tolerance_m = 1e-11;          // of r − l: 10 nm/s at 1 kHz
  static constexpr double nudge_m = 1e-9;  // of p: 𝒢, rounded to some 1e-16 m, differs by that to seven digits

  struct Step {
    double K;
    const V &p, &q;
    bool with_soft = true;
    int sweeps = most_sweeps;
  };
  // Where the limits' shift of p leads.
  struct Try {
    V shift, r;
    typename LimitSets<N>::Nearest l;  // relative to q₁
    V gap;                             // r − l
  };

  Try at(Step& step, const V& shift, const V& r) const noexcept {
    const V relative = r - q_k1_;
    Try result{shift, r, sets_.nearest(relative - shift, step.with_soft, step.sweeps), {}};
    result.gap = relative - result.l.x;
    return result;
  }
  Try at(Step& step, const V& shift) noexcept { return at(step, shift, (*inner_)(step.K, step.p + shift, step.q)); }

  V solve(double K, const V& p, const V& q, const V& free) noexcept {
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
      // A gap that doesn't close any more: contacts and limits have no point in common.
      stuck = std::abs(gap - gap_before) <= 1e-3 * gap ? stuck + 1 : 0;
      if (stuck >= 3 || (!now.l.exact && step.sweeps <= 0)) break;
      gap_before = gap;
    }
    return give_way(step, now);
  }

  // Contacts without friction are half-spaces as limits are, as far as they are flat: the solution is the nearest point
  // of both. Friction is held as it was at the last r; curved surfaces are taken by their tangent planes there.
  enum class Joined : std::uint8_t { settled, unsettled, apart };  // apart: the two have no point in common
  Joined join(Step& step, Try& now, int most) noexcept {
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

  // A force of the contacts less what their normals span.
  [[nodiscard]] V across_contacts(V force) const noexcept {
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

  // Newton's way to r = l, on 𝒢 as differences show it and on the limits that are active:
  //   F(s) = r(s) − P(r(s) − s) = o,   dF = [(E − P′) R + P′] ds,   R = ∂r/∂s
  // Which limits and contacts act is taken anew at each point. False where that doesn't end.
  bool jump(Step& step, Try& now) noexcept {
    for (int k = 0; k < most_jumps && now.l.exact; ++k) {
      Eigen::Matrix<double, N, N> J;
      for (int i = 0; i < N; ++i) {
        const V nudged = now.shift + nudge_m * V::Unit(i);
        const V R_i = ((*inner_)(step.K, step.p + nudged, step.q) - now.r) / nudge_m;
        J.col(i) = R_i - now.l.derivative(R_i - V::Unit(i));
      }
      V ds = J.fullPivLu().solve(-now.gap);
      if (!ds.allFinite()) return false;
      // No further than all forces together are now: where 𝒢 sticks or jams, J is nearly singular.
      const double most = (now.r - step.p).norm(), length = ds.norm();
      if (length > most) ds *= most / length;
      now = at(step, now.shift + ds);
      if (now.gap.norm() <= tolerance_m) return true;
    }
    return false;
  }

  V take(const Try& solution) noexcept {
    limit_shift_ = solution.shift;
    active_ = solution.l.active;
    return solution.r;
  }

  // On the way from q₁, which is in both, to what the contacts allow, nothing is passed through, if the free space is
  // convex. Where the limits leave q₁ out, the contacts give way.
  V give_way(Step& step, const Try& last) noexcept {
    active_ = last.l.active;
    const V held = last.r - step.p - last.shift;  // of the contacts
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

  void gather_contacts() noexcept {
    count_ = 0;
    for (const models::Contact<N>& contact : inner_->contacts()) {
      if (count_ + 1 == contacts_.size()) break;
      contacts_[count_++] = contact;
    }
    if (active_.kinds == 0) return;
    const double length = limit_shift_.norm();
    contacts_[count_++] = {limit_object, active_.kinds, false, length > 0.0 ? V(limit_shift_ / length) : V(V::Zero())};
  }

  models::GeometricAlgorithm<N>* inner_;
  LimitSets<N> sets_;
  V q_k1_ = V::Zero();
  V limit_shift_ = V::Zero();
  ActiveLimits active_;
  bool soft_met_ = true;
  bool squeezed_ = false;
  std::array<models::Contact<N>, 8> contacts_{};
  std::size_t count_ = 0;
};

}  // namespace proxarm::controller
