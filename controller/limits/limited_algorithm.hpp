// Extends a 𝒢 by the limits of a step: q(k) minimises ‖q − p̂‖ over contacts ∩ limits.
//
// The solver looks for the limits' force λ that makes two points equal, r = l:
//   r = 𝒢(κ, p̂ + λ/κ, q₁)   the inner 𝒢's point; the contacts' force, friction included, reacts to λ
//   l = P(r − λ/κ)           the projection P onto the limits
// If r = l, then −λ = κ ((r − λ/κ) − l) is in the limits' normal cone at r. Neither a normal cone nor 𝒢 (Assumption 1)
// depends on κ, so the combined map doesn't depend on κ either. A step counts as solved only if r = l within rounding.
// Methods:
//   free      without contact: λ/κ = P(p̂) − p̂
//   joined    Contacts become half-spaces among the limits, and friction is held constant. On flat surfaces without
//             friction one solution is exact.
//   Newton    Semismooth Newton (Qi and Sun 1993) on r(λ) − l(λ), for friction and media. The derivative comes from
//             finite differences of 𝒢 and from the active limits.
//   in turn   Block Gauss-Seidel, λ/κ ← l − (r − λ/κ). In turns 1, 2, 4, 8 … of this method, the methods joined and
//             Newton are tried first.
// If contacts and limits have no common point, the contacts give way: q is the limits' point nearest to the contacts'
// point r. The steps that follow start the inner 𝒢 from r instead of q₁, until a step keeps the contacts again. So a
// proxy that limits have put into an object comes out on the side on which it went in, also out of a mesh, whose faces
// hold a proxy on both sides. If the limits alone have no common point, the soft limits (leash, power) give way.
//
// If no limit is active, the result equals the inner 𝒢's result to the bit. Nothing allocates, locks or throws.
#pragma once

#include <array>
#include <span>

#include "controller/limits/limit_sets.hpp"
#include "models/base/state_archive.hpp"
#include "models/geometry/geometric_algorithm.hpp"

namespace proxarm::controller {

// Object number of contacts with a limit. Code that counts contacts with the scene skips contacts with this number.
inline constexpr std::int32_t limit_object = -2;

template <int N>
class LimitedAlgorithm final : public models::GeometricAlgorithm<N> {
 public:
  using V = models::Vec<N>;

  // Precondition: `inner` outlives this object.
  explicit LimitedAlgorithm(models::GeometricAlgorithm<N>& inner) : inner_(&inner) {}

  // Sets the limits of the next step. Precondition: called before each step, with sets around the true q₁ = q(k−1),
  // even if a step of order 2 starts from another point.
  void set_limits(const StepLimits& limits, const Eigen::Matrix<double, 3, N>& basis, const V& q_k1) noexcept;

  V operator()(double K, const V& p, const V& q) noexcept override;

  // Returns the place from which contacts count in the next step: q, unless contacts have given way.
  [[nodiscard]] const V& from(const V& q) const noexcept { return gave_way_ ? kept_ : q; }
  // Call when the proxy is put to another place, which counts as outside all objects.
  void start() noexcept { gave_way_ = false; }
  // Call when the proxy is put to a place that contacts exclude: contacts count from `kept`.
  void give_way_at(const V& kept) noexcept {
    gave_way_ = true;
    kept_ = kept;
  }
  // Takes over from which place contacts count.
  void follow(const LimitedAlgorithm& other) noexcept {
    gave_way_ = other.gave_way_;
    kept_ = other.kept_;
  }
  void archive(fieldbus::StateArchive& state) noexcept { state(gave_way_, kept_); }

  void set_time(const models::StepTime& time) noexcept override { inner_->set_time(time); }
  [[nodiscard]] bool wants_time() const noexcept override { return inner_->wants_time(); }
  [[nodiscard]] std::uint32_t media_at(const V& q) const noexcept override { return inner_->media_at(q); }
  [[nodiscard]] bool has_media() const noexcept override { return inner_->has_media(); }
  [[nodiscard]] std::span<const models::Contact<N>> contacts() const noexcept override {
    return {contacts_.data(), count_};
  }
  [[nodiscard]] std::uint64_t unresolved_steps() const noexcept override { return inner_->unresolved_steps(); }
  // True only if contacts squeeze the proxy. If a limit leaves the proxy inside an object, this limit is in active().
  [[nodiscard]] bool squeezed() const noexcept override { return squeezed_; }

  // λ/κ of the last call. The limits' force on the proxy is κ times this.
  [[nodiscard]] const V& limit_shift() const noexcept { return limit_shift_; }
  [[nodiscard]] const ActiveLimits& active() const noexcept { return active_; }
  [[nodiscard]] bool soft_limits_met() const noexcept { return soft_met_; }

 private:
  static constexpr int most_turns = 300;
  static constexpr int few_joins = 3, most_joins = 10;  // iterations of join() with friction; one suffices without it
  static constexpr int most_jumps = 6;                  // iterations of jump(); two or three if it converges
  static constexpr int most_sweeps = 3000;              // Dykstra's sweeps in total per step, some 50 ns each
  static constexpr double tolerance_m = 1e-11;          // tolerance of r = l; 10 nm/s at 1 kHz
  // Change of p for finite differences. They keep seven digits, since 𝒢's rounding errors are 1e-16 m.
  static constexpr double nudge_m = 1e-9;

  struct Step {
    double K;
    const V &p, &q;
    bool with_soft = true;
    int sweeps = most_sweeps;
  };
  // A trial shift of p by the limits, and its results.
  struct Try {
    V shift, r;
    typename LimitSets<N>::Nearest l;  // relative to q₁
    V gap;                             // r − l
  };

  Try at(Step& step, const V& shift, const V& r) noexcept {
    const V relative = r - q_k1_;
    Try result{shift, r, sets_.nearest(relative - shift, step.with_soft, step.sweeps), {}};
    result.gap = relative - result.l.x;
    return result;
  }
  Try at(Step& step, const V& shift) noexcept { return at(step, shift, (*inner_)(step.K, step.p + shift, step.q)); }

  V solve(double K, const V& p, const V& q, const V& free) noexcept;

  // Solves by the method `joined`. A flat contact without friction is a half-space like a limit, so one projection
  // solves for contacts and limits together. Friction keeps its value at the last r; curved surfaces are replaced by
  // their tangent planes at the last r. Result `apart`: contacts and limits have no common point.
  enum class Joined : std::uint8_t { settled, unsettled, apart };
  Joined join(Step& step, Try& now, int most) noexcept;

  // Returns the friction: the part of a contact force that is outside the span of the contacts' normals.
  [[nodiscard]] V across_contacts(V force) const noexcept;

  // Solves r = l by semismooth Newton for the shift s = λ/κ:
  //   F(s) = r(s) − P(r(s) − s) = 0,   dF = [(E − P′) R + P′] ds,   R = ∂r/∂s
  // R comes from finite differences of 𝒢, P′ from the active limits. Each iteration determines the active limits and
  // contacts anew. Returns false if the iteration doesn't converge.
  bool jump(Step& step, Try& now) noexcept;

  V take(const Try& solution) noexcept;

  // Returns the result if r = l has no solution. Usually q₁ keeps contacts and limits; the result is then on the
  // straight line from q₁ to the contacts' point, which crosses no object if the free space is convex. If q₁ is outside
  // the limits, the contacts give way.
  V give_way(Step& step, const Try& last) noexcept;

  void gather_contacts() noexcept;

  models::GeometricAlgorithm<N>* inner_;
  LimitSets<N> sets_;
  V q_k1_ = V::Zero();
  V limit_shift_ = V::Zero();
  ActiveLimits active_;
  bool soft_met_ = true;
  bool squeezed_ = false;
  bool gave_way_ = false;  // the contacts gave way in the last step
  V kept_ = V::Zero();     // the contacts' point of that step
  std::array<models::Contact<N>, 8> contacts_{};
  std::size_t count_ = 0;
};

extern template class LimitedAlgorithm<1>;
extern template class LimitedAlgorithm<2>;
extern template class LimitedAlgorithm<3>;

}  // namespace proxarm::controller
