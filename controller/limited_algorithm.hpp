// A 𝒢 that keeps within a step's limits: q(k) minimises ‖q − p̂‖ over contacts ∩ limits.
//
// Contacts and limits are solved in turn, each with the other's force held (block Gauss-Seidel; for frictionless
// contacts it is Dykstra's algorithm, which converges to the projection onto the intersection). λ: the limits' force.
//   r = 𝒢(κ, p̂ + λ/κ, q₁)               contacts, with their friction under the force that results
//   l = projection of r − λ/κ onto the limits,   λ/κ ← l − (r − λ/κ)
// until r = l. Limits are normal cones and 𝒢 is K-independent, so the whole is. Where no point is in both, the contacts
// give way and q is the limits' point that is nearest to what they allow; where the limits alone have no point in
// common, the soft ones (leash, power) give way.
//
// A step that no limit touches is the 𝒢's own to the bit. Neither allocates, locks nor throws.
#pragma once

#include <algorithm>
#include <array>
#include <span>

#include "controller/step_limits.hpp"
#include "models/geometric_algorithm.hpp"

namespace proxarm::controller {

// Contacts of a limit report this as their object; what counts contacts of the scene skips it.
inline constexpr std::int32_t limit_object = -2;

// The sets of one step in the N coordinates of a scene, and the projection onto them. x is q − q₁.
template <int N>
class LimitSets {
 public:
  using V = models::Vec<N>;

  void clear() noexcept { soft_count_ = plane_count_ = hard_count_ = 0; }

  // The part of sets in W that a scene's space (basis: 3×N, orthonormal) has.
  void set(const StepLimits& limits, const Eigen::Matrix<double, 3, N>& basis) noexcept {
    clear();
    for (std::size_t i = 0; i < limits.soft_count; ++i) soft_[soft_count_++] = cut(limits.soft[i], basis);
    for (std::size_t i = 0; i < limits.hard_count; ++i) hard_[hard_count_++] = cut(limits.hard[i], basis);
    for (std::size_t i = 0; i < limits.plane_count; ++i) {
      const LimitPlane<3>& plane = limits.planes[i];
      const V normal = basis.transpose() * plane.normal;
      const double length = normal.norm();
      if (!(length > 1e-9)) continue;  // parallel to the scene's space: no motion in it comes nearer
      planes_[plane_count_++] = {normal / length, plane.bound_m / length, plane.limit, plane.axis_bits};
    }
  }

  [[nodiscard]] bool contains(const V& x, double tolerance_m, bool with_soft) const noexcept {
    for (std::size_t i = 0; with_soft && i < soft_count_; ++i) {
      if (!inside(soft_[i], x, tolerance_m)) return false;
    }
    for (std::size_t i = 0; i < hard_count_; ++i) {
      if (!inside(hard_[i], x, tolerance_m)) return false;
    }
    for (std::size_t i = 0; i < plane_count_; ++i) {
      if (!(planes_[i].normal.dot(x) <= planes_[i].bound_m + tolerance_m)) return false;
    }
    return true;
  }

  // The sets' point nearest to x by Dykstra's algorithm; the hard balls come last, so that a result which isn't quite
  // there yet satisfies those. `active`: whose force isn't zero.
  // `sweeps`: how many may still be made; what is used is taken off.
  V project(V x, bool with_soft, ActiveLimits& active, int& sweeps) const noexcept {
    std::array<V, 2> soft{}, hard{};
    std::array<double, StepLimits::max_planes> pushed{};  // along the planes' normals, ≥ 0
    for (auto* corrections : {&soft, &hard}) corrections->fill(V::Zero());
    for (bool first = true; first || sweeps > 0; first = false, --sweeps) {
      double change = 0.0;
      const auto onto_ball = [&](const LimitBall<N>& ball, V& correction) {
        const V y = x + correction;
        const double length = (y - ball.centre).norm();
        const bool outside = length > ball.radius_m;
        const V z = outside ? V(ball.centre + ball.radius_m / length * (y - ball.centre)) : y;
        correction = outside ? V(y - z) : V(V::Zero());
        change = std::max(change, (z - x).norm());
        x = z;
      };
      for (std::size_t i = 0; with_soft && i < soft_count_; ++i) onto_ball(soft_[i], soft[i]);
      for (std::size_t i = 0; i < plane_count_; ++i) {
        const double beyond = planes_[i].normal.dot(x) + pushed[i] - planes_[i].bound_m;
        const double push = std::max(0.0, beyond);
        if (push == pushed[i]) continue;
        x += (pushed[i] - push) * planes_[i].normal;
        change = std::max(change, std::abs(pushed[i] - push));
        pushed[i] = push;
      }
      for (std::size_t i = 0; i < hard_count_; ++i) onto_ball(hard_[i], hard[i]);
      if (change <= sweep_tolerance_m) break;
    }
    active = {};
    for (std::size_t i = 0; with_soft && i < soft_count_; ++i) note(soft_[i], soft[i], active);
    for (std::size_t i = 0; i < hard_count_; ++i) note(hard_[i], hard[i], active);
    for (std::size_t i = 0; i < plane_count_; ++i) {
      if (pushed[i] > 0.0) active.set(planes_[i].limit, planes_[i].axis_bits);
    }
    return x;
  }

  // x, drawn back into the sets along the straight line to where braking leads (q₁, where that is in them): for what
  // the alternation of contacts and limits, or Dykstra's algorithm, left outside.
  [[nodiscard]] V draw_back(const V& x, bool with_soft) const noexcept {
    V base = V::Zero();
    for (std::size_t i = 0; i < hard_count_; ++i) {  // the last ball, acceleration's, decides
      const double off = (base - hard_[i].centre).norm();
      if (off > hard_[i].radius_m) base = hard_[i].centre + hard_[i].radius_m / off * (base - hard_[i].centre);
    }
    const V d = x - base;
    double t = 1.0;
    for (std::size_t i = 0; i < plane_count_; ++i) {
      const double room = planes_[i].bound_m - planes_[i].normal.dot(base), way = planes_[i].normal.dot(d);
      if (room >= 0.0 && way > room) t = std::min(t, room / way);
    }
    for (std::size_t i = 0; i < hard_count_; ++i) t = std::min(t, way_within(hard_[i], base, d));
    for (std::size_t i = 0; with_soft && i < soft_count_; ++i) t = std::min(t, way_within(soft_[i], base, d));
    return base + t * d;
  }

 private:
  static constexpr double sweep_tolerance_m = 1e-13;

  static bool inside(const LimitBall<N>& ball, const V& x, double tolerance_m) noexcept {
    return (x - ball.centre).norm() <= ball.radius_m + tolerance_m;
  }
  // The largest t ≤ 1 for which base + t d is in the ball, with base in it: ‖base − c + t d‖² = r².
  static double way_within(const LimitBall<N>& ball, const V& base, const V& d) noexcept {
    const V from = base - ball.centre;
    const double a = d.squaredNorm(), b = from.dot(d);
    const double c = std::min(0.0, from.squaredNorm() - ball.radius_m * ball.radius_m);
    if (!(a + 2.0 * b + c > 0.0)) return 1.0;
    return std::clamp((std::sqrt(b * b - a * c) - b) / a, 0.0, 1.0);
  }
  static void note(const LimitBall<N>& ball, const V& correction, ActiveLimits& active) noexcept {
    if (correction != V::Zero()) active.set(ball.limit);
  }
  // What a ball in space leaves of the scene's line or plane through q₁; a point where it doesn't reach it.
  static LimitBall<N> cut(const LimitBall<3>& ball, const Eigen::Matrix<double, 3, N>& basis) noexcept {
    const V centre = basis.transpose() * ball.centre;
    const double off2 = (ball.centre - basis * centre).squaredNorm();
    if constexpr (N == 3) return {centre, ball.radius_m, ball.limit};
    return {centre, std::sqrt(std::max(0.0, ball.radius_m * ball.radius_m - off2)), ball.limit};
  }

  std::array<LimitBall<N>, 2> soft_{}, hard_{};
  std::array<LimitPlane<N>, StepLimits::max_planes> planes_{};
  std::size_t soft_count_ = 0, plane_count_ = 0, hard_count_ = 0;
};

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
  static constexpr int most_sweeps = 3000;      // of a step in all, some 50 ns each
  static constexpr double tolerance_m = 1e-11;  // 10 nm/s at 1 kHz

  V solve(double K, const V& p, const V& q, V r) noexcept {
    bool with_soft = true;
    int sweeps = most_sweeps;
    V shift = V::Zero(), l = r;
    double gap_before = -1.0;
    int stuck = 0;
    for (int turn = 0; turn < most_turns; ++turn) {
      const V held = r - p - shift;  // of the contacts
      const V free = p + held - q_k1_;
      l = sets_.project(free, with_soft, active_, sweeps);
      if (turn == 0 && !sets_.contains(l, 1e-9, with_soft)) {
        with_soft = soft_met_ = false;
        l = sets_.project(free, with_soft, active_, sweeps);
      }
      shift = l - free;
      r = (*inner_)(K, p + shift, q);
      limit_shift_ = shift;
      if (sets_.contains(r - q_k1_, tolerance_m, with_soft)) return r;
      // A gap that doesn't close any more: contacts and limits have no point in common.
      const double gap = (r - q_k1_ - l).norm();
      stuck = std::abs(gap - gap_before) <= 1e-3 * gap ? stuck + 1 : 0;
      if (stuck >= 3 || sweeps <= 0) break;
      gap_before = gap;
    }
    // On the way from q₁, which is in both, to what the contacts allow, nothing is passed through, if the free space is
    // convex. Where the limits leave q₁ out, the contacts give way.
    const V held = r - p - shift;
    if (sets_.contains(V::Zero(), tolerance_m, with_soft)) {
      l = sets_.draw_back(r - q_k1_, with_soft);
    } else {
      sweeps = std::max(sweeps, most_sweeps / 4);
      l = sets_.project(p + held - q_k1_, with_soft, active_, sweeps);
      if (!sets_.contains(l, 1e-10, false)) l = sets_.draw_back(l, false);
    }
    limit_shift_ = l + q_k1_ - p - held;
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
