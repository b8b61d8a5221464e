// Order 2 of the admittance proxy: (26) with forces weighted over the last steps, and one call of 𝒢.
//
// (26) uses the world's force at the end of a step, f(k) at t_{k+1}. For second order it should act between two steps,
// at t_k. With f₁ = f(k−1) and so on, F = f − K_v(q − q_ref) − B(3q − 4q₁ + q₂)/(2T), and the weights w,
//   M∇²q/T² = h + w₀F + w₁F₁ + w₂F₂ + w₃F₃   gives, for the same 𝒢,
//   κ = M/(w₀T²) + 3B/(2T) + K_v,   p̂ = q₁ + [(M/(w₀T²) + B/(2T))(q₁ − q₂) + K_v(q_ref − q₁)
//                                             + (h + w₁F₁ + w₂F₂ + w₃F₃)/w₀]/κ
// The weights are those of a power of 1 − c∇ whose mean is at the required time:
//   surfaces   (1 − ∇/3)³ = (8, 12, 6, 1)/27       laws of position, at t_{k+1}
//   media      (1 − ∇/6)³ = (125, 75, 15, 1)/216   laws of velocity, at t_{k+½}, the time of ∇q/T
//   start      (1, 5)/6: the first step of a proxy that starts in contact; its force there is Ma − h
// The first is generalised-α (Chung and Hulbert 1993) with ρ = 1/2. All roots of M(1−w)² + T²K W(w), W(w) the weights
// with w = z⁻¹, have |z| ≤ 1 for a spring K of any stiffness, and |z| = 1/2 for a rigid wall. With a constant force
// (flat walls, friction) or none, it is (26) itself.
//
// h + ∇²h/12 replaces h (Störmer's correction), so that free motion has order 3. This amplifies white noise of h by
// 1.10.
//
// Events are: a contact begins or ends; friction begins to stick or to slip, or would push the proxy on; a limit; a
// change of T; a step that 𝒢 leaves unresolved. (26) computes these steps, and its force fills the history. Two more
// such steps follow an impact: in the next one, q₁ − q₂ still contains a part of the approach, and its force the rest
// of the impact.
//
// If friction releases a proxy at rest, it does so within a step. Let a be the force left over in the first step of the
// slide and Δ the growth of h since the last step; the release was at t_k − θT, θ = a/Δ. For a force that grows
// linearly from there, the sum over samples differs from its integral by T Δ(θ² − θ + 1/3)/2. The next step adds this.
//
// Laws of velocity need the rate of q at the law's time. If friction turns, or a proxy is in a medium and in contact, 𝒢
// is evaluated again from q̃ = (4q₁ − q₂)/3 with 2T/3: (q − q̃)/(2T/3) is the rate at t_{k+1}. If the proxy enters or
// leaves a medium, the step is cut at the border (found by bisection). Two steps along parabolas of constant
// acceleration follow, which give the new history.
//
// One caller at a time. step() may be called in the cycle: it doesn't allocate, lock, throw or print.
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
  // T has changed, so the forces measured so far are no longer a history.
  void forget_forces() noexcept {
    forces_known_ = 0;
    free_since_start_ = false;
  }

  // One period under the measured force h(k), into `out`. `of_26`: coefficients of (26) for this step. A fault leaves
  // everything unchanged, so the step may be repeated.
  ProxyFault step(const ProxyRule& of_26, const ProxyHistory<N>& past, const V& h, const V& q_ref,
                  const ProxySolver<N>& solve, ProxyTrial<N>& out) noexcept;

  // After a step cut at a medium's border: q(k−2) for the next step, the proxy's previous place under its new
  // acceleration. Otherwise nullptr, and q(k−1) of the last step is used.
  [[nodiscard]] const V* came_from() const noexcept { return cut_ ? &came_from_ : nullptr; }

  // Steps since start() without weighting of the world's force.
  [[nodiscard]] std::uint64_t first_order_steps() const noexcept { return first_order_steps_; }

  void archive(fieldbus::StateArchive& state) noexcept {
    state(mode_, contacts_, media_, restart_steps_left_, parabolas_left_, first_order_steps_);
    state(F_[0], F_[1], F_[2], h_k1_, h_k2_, forces_known_, free_since_start_, v_, cut_, came_from_, lets_go_, onset_,
          steady_);
  }

 private:
  static constexpr std::size_t max_contacts = 8;

  enum class Mode : std::uint8_t {
    starting,  // in a contact that existed before; F_[0] is Ma
    free,      // no force but h: (26)
    surface,   // the weights of surfaces
    medium,    // the weights of media
  };

  // The objects and features in contact, and whether they slip. A change of this set is an event.
  struct ContactSet {
    struct Key {
      std::int32_t object, feature;
      bool slips;
    };
    std::array<Key, max_contacts> keys;  // the first `count`
    std::size_t count = 0;
    bool overflow = false;  // more contacts than fit; then unequal to any set
    bool known = true;
    bool held = false;     // q is unchanged to the bit, although p̂ isn't
    bool acts = false;     // a force without contact or medium: 𝒢 reports no contacts
    bool slips = false;    // at least one contact slips
    bool limited = false;  // a limit acts, which isn't part of the world

    void archive(fieldbus::StateArchive& state) noexcept {
      state(count, overflow, known, held, acts, slips, limited);
      count = std::min(count, max_contacts);
      for (Key& key : std::span(keys).first(count)) state(key.object, key.feature, key.slips);
    }
  };

  // Weights, and the coefficients that follow from them and M, B, K_v, T:
  //   p̂ = q₁ + of_move (q₁ − q₂) + of_reference (q_ref − q₁) + of_force (h + w₁F₁ + w₂F₂ + w₃F₃)
  struct Rule {
    double w0 = 1.0;
    std::array<double, 3> w{};
    double kappa = 0.0, of_move = 0.0, of_reference = 0.0, of_force = 0.0;
  };

  // Input of all methods of a step. h: with Störmer's correction; h_k: as measured.
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

  // Whether two forces differ by less than a millionth, so that the weights would change less than that.
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

  // Set by prepare().
  Rule surface_, medium_, start_;
  double mass_kg_ = 1.0, damping_Ns_per_m_ = 0.0, spring_N_per_m_ = 0.0;
  double period_s_ = 1e-3;
  bool undamped_ = true;  // no B and no K_v

  Mode mode_ = Mode::free;
  ContactSet contacts_;         // of the last step
  std::uint32_t media_ = 0;     // at q₁
  bool has_media_ = false;      // of 𝒢
  int restart_steps_left_ = 0;  // steps by (26) before forces are weighted again
  int parabolas_left_ = 0;      // remaining steps along parabolas
  std::uint64_t first_order_steps_ = 0;
  std::array<V, 3> F_{V::Zero(), V::Zero(), V::Zero()};  // F₁, F₂, F₃
  V h_k1_ = V::Zero(), h_k2_ = V::Zero();                // h(k−1), h(k−2) as measured
  int forces_known_ = 0;                                 // steps with this T so far; at most 3
  bool free_since_start_ = false;
  V v_ = V::Zero();  // during parabolas: velocity at q₁
  bool cut_ = false;
  V came_from_ = V::Zero();
  bool steady_ = false;   // F has been constant for three steps
  bool lets_go_ = false;  // friction released the proxy in the last step; the next adds onset_
  V onset_ = V::Zero();
};

extern template class ForceWeights<1>;
extern template class ForceWeights<2>;
extern template class ForceWeights<3>;

}  // namespace proxarm::controller
