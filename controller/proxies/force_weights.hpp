// Computes a step of order 2 of the admittance proxy: (26) with forces weighted over the last steps, and usually one
// call of 𝒢.
//
// (26) uses the world's force at the end of a step: f(k) at t_{k+1}. For second order it should use the force at t_k.
// Let f₁ = f(k−1), and so on with the other symbols. F is the force of world, spring and damping:
//   F = f − K_v(q − q_ref) − B(3q − 4q₁ + q₂)/(2T)
// With weights w₀ … w₃ the equation of motion is
//   M∇²q/T² = h + w₀F + w₁F₁ + w₂F₂ + w₃F₃
// It needs no other 𝒢 than (26), but
//   κ = M/(w₀T²) + 3B/(2T) + K_v,   p̂ = q₁ + [(M/(w₀T²) + B/(2T))(q₁ − q₂) + K_v(q_ref − q₁)
//                                             + (h + w₁F₁ + w₂F₂ + w₃F₃)/w₀]/κ
// The weights are the coefficients of a power of 1 − c∇ that shifts the forces from the time of their law to t_k:
//   surfaces   (1 − ∇/3)³ = (8, 12, 6, 1)/27       for laws of position, at t_{k+1}
//   media      (1 − ∇/6)³ = (125, 75, 15, 1)/216   for laws of velocity, at t_{k+½}, the time of ∇q/T
//   start      (1, 5)/6                            for the first step of a proxy that starts in contact, where the
//                                                  force is Ma − h
// The weights of surfaces are generalised-α (Chung and Hulbert 1993) with ρ = 1/2. For a spring K of any stiffness, all
// roots z of M(1 − 1/z)² + T²K (w₀ + w₁/z + w₂/z² + w₃/z³) have |z| ≤ 1; for a rigid wall they have |z| = 1/2. If the
// world's force is constant (flat walls, friction) or zero, a step equals a step of (26).
//
// h + ∇²h/12 replaces h (Störmer's correction), so that free motion has order 3. This correction amplifies white noise
// of h by 1.10.
//
// (26) computes the steps in which an event happens, and its force fills the history. Events are:
//   - A contact begins or ends.
//   - Friction begins to stick or to slip, or would push the proxy on.
//   - A limit is active.
//   - T has changed.
//   - 𝒢 leaves a step unresolved.
// After an impact (26) computes two more steps: in the first of them, q₁ − q₂ still contains a part of the approach,
// and the force contains the rest of the impact.
//
// If friction releases a proxy at rest, the release is at a time between two samples. a: the force that friction
// doesn't balance in the first step of the slide. Δ: the growth of h since the last step. The release was at t_k − θT,
// θ = a/Δ. If the unbalanced force grows linearly from the release on, its sum over samples differs from its integral
// by T Δ(θ² − θ + 1/3)/2. The next step adds this difference.
//
// Laws of velocity need the rate of q at the law's time. If friction changes its direction, or if a proxy is in a
// medium and in contact, 𝒢 is evaluated again from q̃ = (4q₁ − q₂)/3 with 2T/3: (q − q̃)/(2T/3) is the rate at t_{k+1}.
// If the proxy enters or leaves a medium, the step is cut at the medium's border (found by bisection). Two steps along
// parabolas of constant acceleration follow; they give the new history.
//
// One caller at a time. step() may be called in the cycle, since it doesn't allocate, lock, throw or print.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "controller/proxies/proxy_step.hpp"
#include "models/base/state_archive.hpp"
#include "models/geometry/geometric_algorithm.hpp"

namespace proxarm::controller {

template <int N>
class ForceWeights {
 public:
  using V = models::Vec<N>;

  // Computes the coefficients from M, B, K_v and T. Precondition: `config` passes validate().
  void prepare(const AdmittanceConfig& config) noexcept;

  void start(const ProxyStart<N>& start, const ProxySolver<N>& solve) noexcept;
  // Call when T has changed: the hand's forces measured so far are then no history.
  void forget_forces() noexcept {
    forces_known_ = 0;
    free_since_start_ = false;
  }

  // Computes one period under the measured force h(k); the result is `out`. `of_26`: coefficients of (26) for this
  // step. A fault leaves everything unchanged, so the step may be repeated.
  ProxyFault step(const ProxyRule& of_26, const ProxyHistory<N>& past, const V& h, const V& q_ref,
                  const ProxySolver<N>& solve, ProxyTrial<N>& out) noexcept;

  // After a step that was cut at a medium's border: q(k−2) for the next step, where the proxy would have been with its
  // new acceleration. Otherwise nullptr: q(k−2) of the next step is then q(k−1) of the last step.
  [[nodiscard]] const V* came_from() const noexcept { return cut_ ? &came_from_ : nullptr; }

  // Number of steps since start() in which the world's force wasn't weighted.
  [[nodiscard]] std::uint64_t first_order_steps() const noexcept { return first_order_steps_; }

  void archive(fieldbus::StateArchive& state) noexcept {
    state(mode_, contacts_, media_, restart_steps_left_, parabolas_left_, first_order_steps_);
    state(F_[0], F_[1], F_[2], h_k1_, h_k2_, forces_known_, free_since_start_, v_, cut_, came_from_, lets_go_, onset_,
          steady_);
  }

 private:
  static constexpr std::size_t max_contacts = 8;

  enum class Mode : std::uint8_t {
    starting,  // the motion begins in a contact that existed before; F_[0] is Ma
    free,      // h is the only force, so (26) is used
    surface,   // the weights of surfaces are used
    medium,    // the weights of media are used
  };

  // The objects and features in contact, and whether they slip. A change of this set is an event.
  struct ContactSet {
    struct Key {
      std::int32_t object, feature;
      bool slips;
    };
    std::array<Key, max_contacts> keys;  // the first `count` keys are valid
    std::size_t count = 0;
    bool overflow = false;  // there are more contacts than keys; the set then counts as unequal to every set
    bool known = true;
    bool held = false;     // q equals the last q to the bit, but p̂ doesn't
    bool acts = false;     // the world's force isn't zero, but 𝒢 reports no contact and there is no medium
    bool slips = false;    // at least one contact slips
    bool limited = false;  // a limit, which isn't part of the world, is active

    void archive(fieldbus::StateArchive& state) noexcept {
      state(count, overflow, known, held, acts, slips, limited);
      count = std::min(count, max_contacts);
      for (Key& key : std::span(keys).first(count)) state(key.object, key.feature, key.slips);
    }
  };

  // Weights, and the coefficients that follow from weights, M, B, K_v and T:
  //   p̂ = q₁ + of_move (q₁ − q₂) + of_reference (q_ref − q₁) + of_force (h + w₁F₁ + w₂F₂ + w₃F₃)
  struct Rule {
    double w0 = 1.0;
    std::array<double, 3> w{};
    double kappa = 0.0, of_move = 0.0, of_reference = 0.0, of_force = 0.0;
  };

  // Input of all methods of a step. h: the hand's force with Störmer's correction. h_k: the measured force.
  struct Given {
    const ProxyRule& of_26;
    const ProxyHistory<N>& past;
    const V &h, &h_k, &q_ref;
    const ProxySolver<N>& solve;
  };

  static Rule rule(double w0, std::array<double, 3> w, const AdmittanceConfig& config) noexcept;
  [[nodiscard]] ContactSet contacts_of(const Given& given, const ProxyTrial<N>& out,
                                       const V& q_previous) const noexcept;
  static bool same(const ContactSet& a, const ContactSet& b) noexcept;
  static bool gained(const ContactSet& before, const ContactSet& now) noexcept;
  static bool same_sides(const ContactSet& set, const std::array<V, max_contacts>& normals,
                         std::span<const models::Contact<N>> contacts) noexcept;

  // Whether two forces differ by less than a millionth. Weighting would then change the force by even less.
  static bool as_much(const V& a, const V& b) noexcept { return (a - b).squaredNorm() <= 1e-12 * b.squaredNorm(); }
  [[nodiscard]] V own_force(const V& q, const V& q_ref, const V& v) const noexcept {
    return -spring_N_per_m_ * (q - q_ref) - damping_Ns_per_m_ * v;
  }
  [[nodiscard]] std::uint32_t media_at(const Given& given, const V& q) const noexcept {
    return has_media_ ? given.solve.g().media_at(q) : 0;
  }
  ProxyFault take_step(const Given& given, ProxyTrial<N>& out) noexcept;
  enum class Steady : std::uint8_t { yes, no, event };
  Steady steady_step(const Given& given, ProxyTrial<N>& out, ProxyFault& fault) noexcept;
  ProxyFault weighted(const Given& given, ProxyTrial<N>& out, bool& event) noexcept;
  [[nodiscard]] bool as_before(const Given& given, const ProxyTrial<N>& out) const noexcept;
  ProxyFault from_ahead(const Given& given, std::uint64_t unresolved, ProxyTrial<N>& out, ContactSet& now,
                        bool& event) noexcept;
  bool in_reach(const Given& given, const ProxyTrial<N>& out) noexcept;
  ProxyFault first_order(const Given& given, ProxyTrial<N>& out) noexcept;
  void take_first_order(const Given& given, ProxyTrial<N>& out) noexcept;
  [[nodiscard]] bool crosses(const Given& given, const ProxyTrial<N>& out) const noexcept;
  ProxyFault cut(const Given& given, ProxyTrial<N>& out, bool& event) noexcept;
  ProxyFault parabola(const Given& given, ProxyTrial<N>& out, bool& event) noexcept;
  void report(const Given& given, const V& p_hat_of_26, ProxyTrial<N>& out) const noexcept;
  void take_weighted(const Given& given, const V& p_hat_of_26, ProxyTrial<N>& out) noexcept;
  void look_for_onset(const Given& given, const ProxyTrial<N>& out) noexcept;

  // prepare() sets the following members.
  Rule surface_, medium_, start_;
  double mass_kg_ = 1.0, damping_Ns_per_m_ = 0.0, spring_N_per_m_ = 0.0;
  double period_s_ = 1e-3;
  bool undamped_ = true;  // B = K_v = 0

  Mode mode_ = Mode::free;
  ContactSet contacts_;         // contacts of the last step
  std::uint32_t media_ = 0;     // media at q₁
  bool has_media_ = false;      // 𝒢 has media
  int restart_steps_left_ = 0;  // remaining steps by (26) before forces are weighted again
  int parabolas_left_ = 0;      // remaining steps along parabolas
  std::uint64_t first_order_steps_ = 0;
  std::array<V, 3> F_{V::Zero(), V::Zero(), V::Zero()};  // F₁, F₂, F₃
  V h_k1_ = V::Zero(), h_k2_ = V::Zero();                // measured h(k−1), h(k−2)
  int forces_known_ = 0;                                 // number of steps with this T so far; counts to 3
  bool free_since_start_ = false;
  V v_ = V::Zero();  // velocity at q₁, during steps along parabolas
  bool cut_ = false;
  V came_from_ = V::Zero();
  bool steady_ = false;   // F has been constant for three steps
  bool lets_go_ = false;  // friction released the proxy in the last step; the next step adds onset_
  V onset_ = V::Zero();
};

extern template class ForceWeights<1>;
extern template class ForceWeights<2>;
extern template class ForceWeights<3>;

}  // namespace proxarm::controller
