// Order 2 of the admittance proxy: (26) whose forces are weighted over the last steps, with one call of 𝒢.
//
// (26) takes the world's force at the end of a step, f(k) at t_{k+1}, where it should act in the middle of two steps,
// at t_k. With f₁ = f(k−1) and so on, F = f − K_v(q − q_ref) − B(3q − 4q₁ + q₂)/(2T), and w the weights:
//   M∇²q/T² = h + w₀F + w₁F₁ + w₂F₂ + w₃F₃   gives, for the same 𝒢,
//   κ = M/(w₀T²) + 3B/(2T) + K_v,   p̂ = q₁ + [(M/(w₀T²) + B/(2T))(q₁ − q₂) + K_v(q_ref − q₁)
//                                             + (h + w₁F₁ + w₂F₂ + w₃F₃)/w₀]/κ
// The weights are those of a power of 1 − c∇, whose mean lies where the force should be:
//   surfaces   (1 − ∇/3)³ = (8, 12, 6, 1)/27       of laws of position, at t_{k+1}
//   media      (1 − ∇/6)³ = (125, 75, 15, 1)/216   of laws of velocity, at t_{k+½}, where ∇q/T belongs
//   start      (1, 5)/6: the first step of a proxy that starts in contact; its force there is Ma − h
// The first is generalised-α (Chung and Hulbert 1993) with ρ = 1/2. All roots of M(1−w)² + T²K W(w), W(w) the weights
// with w = z⁻¹, keep |z| ≤ 1 for a spring K of any stiffness, and those of a rigid wall have |z| = 1/2. Where the force
// is constant (flat walls, friction) or nil it is (26) itself.
//
// h is replaced by h + ∇²h/12 (Störmer's correction), with which free motion is of order 3. White noise of h becomes
// 1.10 times as large by it.
//
// Events are a contact that begins or ends, friction that sets in, lets go or would push on, a limit, a change of T,
// and a step for which 𝒢 has no answer that keeps its laws. They are stepped by (26), whose force fills the history.
// After an impact two more such steps follow: the next one's q₁ − q₂ still contains a part of the approach, and its
// force the rest of the impact.
//
// Where friction lets go of a proxy at rest, it did so within a step: with a the force left over in the first step of
// the slide, and Δ what h grew by since the last one, at the share θ = a/Δ of it before t_k. The sum over samples of a
// force that grows linearly from there differs from its integral by T Δ(θ² − θ + 1/3)/2, which the next step adds.
//
// Laws of velocity want q's rate at the law's time. Where friction turns, or a proxy is in a medium and in contact, 𝒢
// is asked again from q̃ = (4q₁ − q₂)/3 with 2T/3: (q − q̃)/(2T/3) is the rate at t_{k+1}. Where the proxy enters or
// leaves a medium, the step is cut at the border (found by halving), and two steps along parabolas of constant
// acceleration follow, from which the new history is taken.
//
// One caller at a time; step() is for the cycle: it neither allocates, locks, throws nor prints.
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
  // From now on T is another one, so the forces measured so far are no history of it.
  void forget_forces() noexcept {
    forces_known_ = 0;
    free_since_start_ = false;
  }

  // One period under the measured force h(k), into `out`. `of_26`: (26)'s own coefficients for this step. After a fault
  // nothing has changed, and the step may be repeated.
  ProxyFault step(const ProxyRule& of_26, const ProxyHistory<N>& past, const V& h, const V& q_ref,
                  const ProxySolver<N>& solve, ProxyTrial<N>& out) noexcept;

  // What the next step takes for q(k−2), if not q(k−1) of the last step, which was cut at a medium's border: where the
  // proxy would have come from with its new acceleration. Otherwise nullptr.
  [[nodiscard]] const V* came_from() const noexcept { return cut_ ? &came_from_ : nullptr; }

  // The number of steps since start() in which the world's force wasn't weighted.
  [[nodiscard]] std::uint64_t first_order_steps() const noexcept { return first_order_steps_; }

  void archive(fieldbus::StateArchive& state) noexcept {
    state(mode_, contacts_, media_, restart_steps_left_, parabolas_left_, first_order_steps_);
    state(F_[0], F_[1], F_[2], h_k1_, h_k2_, forces_known_, free_since_start_, v_, cut_, came_from_, lets_go_, onset_,
          steady_);
  }

 private:
  static constexpr std::size_t max_contacts = 8;

  enum class Mode : std::uint8_t {
    starting,  // in a contact that was there before; F_[0] is Ma
    free,      // no force but h: (26)
    surface,   // the weights of surfaces
    medium,    // the weights of media
  };

  // The objects that press, where they do, and whether they slip. A change of this set is an event.
  struct ContactSet {
    struct Key {
      std::int32_t object, feature;
      bool slips;
    };
    std::array<Key, max_contacts> keys;  // the first `count`
    std::size_t count = 0;
    bool overflow = false;  // more contacts than fit; then never equal to another set
    bool known = true;
    bool held = false;     // q is bit for bit where it came from, although p̂ isn't
    bool acts = false;     // there is a force without contact or medium: of a 𝒢 that reports none
    bool slips = false;    // some contact does
    bool limited = false;  // a limit acts, which is no part of the world

    void archive(fieldbus::StateArchive& state) noexcept {
      state(count, overflow, known, held, acts, slips, limited);
      count = std::min(count, max_contacts);
      for (Key& key : std::span(keys).first(count)) state(key.object, key.feature, key.slips);
    }
  };

  // Weights, and the coefficients that follow from them, M, B, K_v and T:
  //   p̂ = q₁ + of_move (q₁ − q₂) + of_reference (q_ref − q₁) + of_force (h + w₁F₁ + w₂F₂ + w₃F₃)
  struct Rule {
    double w0 = 1.0;
    std::array<double, 3> w{};
    double kappa = 0.0, of_move = 0.0, of_reference = 0.0, of_force = 0.0;
  };

  // The input that all methods of a step share. h: with Störmer's correction; h_k: as measured.
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

  // Whether two forces differ by less than a millionth: what the weights would change is less than that.
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

  // Made by prepare().
  Rule surface_, medium_, start_;
  double mass_kg_ = 1.0, damping_Ns_per_m_ = 0.0, spring_N_per_m_ = 0.0;
  double period_s_ = 1e-3;
  bool undamped_ = true;  // no B and no K_v

  Mode mode_ = Mode::free;
  ContactSet contacts_;         // of the last step
  std::uint32_t media_ = 0;     // at q₁
  bool has_media_ = false;      // of 𝒢
  int restart_steps_left_ = 0;  // steps by (26) to come before forces are weighted again
  int parabolas_left_ = 0;      // steps along parabolas to come
  std::uint64_t first_order_steps_ = 0;
  std::array<V, 3> F_{V::Zero(), V::Zero(), V::Zero()};  // F₁, F₂, F₃
  V h_k1_ = V::Zero(), h_k2_ = V::Zero();                // h(k−1), h(k−2) as measured
  int forces_known_ = 0;                                 // how many steps there were with this T; 3 at most
  bool free_since_start_ = false;
  V v_ = V::Zero();  // while parabolas are left: the velocity at q₁
  bool cut_ = false;
  V came_from_ = V::Zero();
  bool steady_ = false;   // F has been the same for three steps
  bool lets_go_ = false;  // friction did in the last step, and the next one is owed onset_
  V onset_ = V::Zero();
};

extern template class ForceWeights<1>;
extern template class ForceWeights<2>;
extern template class ForceWeights<3>;

}  // namespace proxarm::controller
