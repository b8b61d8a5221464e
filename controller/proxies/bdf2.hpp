// Order 2 of the admittance proxy: BDF2 (the backward differentiation formula over two steps) through the paper's 𝒢,
// and the first-order steps at events, across which it must not look back.
//
// With q₁ = q(k−1), q₂ = q(k−2), v₁, v₂ their velocities:
//   v = (3q − 4q₁ + q₂)/(2T),  a = (3v − 4v₁ + v₂)/(2T)  in  Ma + Bv + K_v(q − q_ref) = h + f  gives
//   κ = 9M/(4T²) + 3B/(2T) + K_v,   q̃ = (4q₁ − q₂)/3   (so that v = (q − q̃)/(2T/3): 𝒢's previous proxy, and its T)
//   p̂ = [M(12q₁ − 3q₂ + 2T(4v₁ − v₂))/(4T²) + (3B/2T) q̃ + K_v q_ref + h]/κ,   q = 𝒢(κ, p̂, q̃)
//
// Events are a contact that begins or ends, friction that sets in or lets go, a change of T, and a step for which 𝒢 has
// no answer that keeps its laws. They are stepped by methods that don't need q₂:
//   - An impact: by implicit Euler, since BDF2 would rebound where (26) doesn't. The velocity after this step still
//     contains a part of the approach, so two more Euler steps follow, which leave a clean history.
//   - The other events, without B and K_v: along the parabola of constant acceleration, as is the one step after them.
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
class Bdf2 {
 public:
  using V = models::Vec<N>;

  // Computes the coefficients from M, B, K_v and T. Precondition: `config` passes validate().
  void prepare(const AdmittanceConfig& config) noexcept;

  // Begins a motion. With plain labels the history begins a period before the start. If an object lies in between, this
  // is no free motion: `past.q_k1` moves to where 𝒢 leaves it, and the first step doesn't use earlier points.
  void start(const ProxyStart<N>& start, const ProxySolver<N>& solve, ProxyHistory<N>& past) noexcept;

  // One period under the measured force h(k), into `out`. After a fault nothing has changed, and the step may be
  // repeated.
  ProxyFault step(const ProxyHistory<N>& past, const V& h, const V& q_ref, const ProxySolver<N>& solve,
                  ProxyTrial<N>& out) noexcept;

  // The number of steps since start() that didn't use q(k−2).
  [[nodiscard]] std::uint64_t first_order_steps() const noexcept { return first_order_steps_; }

  void archive(fieldbus::StateArchive& state) noexcept {
    state(contacts_, restart_steps_left_, after_impact_, first_order_steps_);
  }

 private:
  static constexpr std::size_t max_contacts = 8;

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
    bool held = false;  // as in ProxyTrial; a 𝒢 that reports no contacts may stick all the same

    void archive(fieldbus::StateArchive& state) noexcept {
      state(count, overflow, known, held);
      count = std::min(count, max_contacts);
      for (Key& key : std::span(keys).first(count)) state(key.object, key.feature, key.slips);
    }
  };

  // The input that all methods of a step share.
  struct Given {
    const ProxyHistory<N>& past;
    const V& h;
    const V& q_ref;
    const ProxySolver<N>& solve;
  };

  static void set_contacts(ContactSet& set, std::span<const models::Contact<N>> contacts, bool held) noexcept;
  static bool same(const ContactSet& a, const ContactSet& b) noexcept;
  static bool gained(const ContactSet& before, const ContactSet& now) noexcept;
  static bool same_sides(const ContactSet& set, const std::array<V, max_contacts>& normals,
                         std::span<const models::Contact<N>> contacts) noexcept;

  ProxyFault look_back(const Given& given, ProxyTrial<N>& out, ContactSet& now, bool& event) noexcept;
  ProxyFault from_ahead(const Given& given, const V& q_tilde, std::uint64_t unresolved, ProxyTrial<N>& out,
                        ContactSet& now, bool& event) noexcept;
  bool in_reach(const Given& given, const ProxyTrial<N>& out) noexcept;
  ProxyFault restart(const Given& given, ProxyTrial<N>& out, ContactSet& now, bool changed) noexcept;
  ProxyFault euler(const Given& given, ProxyTrial<N>& out) noexcept;
  ProxyFault parabola(const Given& given, ProxyTrial<N>& out) noexcept;

  // Made by prepare().
  ProxyRule bdf2_, euler_, parabola_;
  double period_s_ = 0.0, rate_Hz_ = 0.0;  // T, 1/T
  bool undamped_ = true;                   // no B and no K_v
  bool matched_labels_ = false;

  ContactSet contacts_;         // of the last step
  int restart_steps_left_ = 0;  // first-order steps to come before q(k−2) is used again
  bool after_impact_ = false;   // these are steps by Euler
  std::uint64_t first_order_steps_ = 0;
};

extern template class Bdf2<1>;
extern template class Bdf2<2>;
extern template class Bdf2<3>;

}  // namespace proxarm::controller
