#include "controller/proxies/bdf2.hpp"

namespace proxarm::controller {

template <int N>
void Bdf2<N>::prepare(const AdmittanceConfig& config) noexcept {
  const double M = config.mass_kg, B = config.damping_Ns_per_m, K_v = config.spring_N_per_m, T = config.period_s;
  bdf2_ = ProxyRule::of(9.0 * M / (4.0 * T * T) + 3.0 * B / (2.0 * T) + K_v, K_v);
  bdf2_.of_move = (3.0 * M / (4.0 * T * T) + B / (2.0 * T)) / bdf2_.kappa;
  bdf2_.of_v1 = 2.0 * M / T / bdf2_.kappa;
  bdf2_.of_v2 = -0.25 * bdf2_.of_v1;
  euler_ = ProxyRule::of(M / (T * T) + B / T + K_v, K_v);
  euler_.of_v1 = M / T / euler_.kappa;
  parabola_ = {.kappa = 2.0 * M / (T * T), .compliance = 0.5 * T * T / M, .of_v1 = T};
  period_s_ = T;
  rate_Hz_ = 1.0 / T;
  undamped_ = B == 0.0 && K_v == 0.0;
  matched_labels_ = config.matched_labels;
}

template <int N>
void Bdf2<N>::start(const ProxyStart<N>& start, const ProxySolver<N>& solve, ProxyHistory<N>& past) noexcept {
  contacts_ = {};
  contacts_.known = !start.contact_established;
  restart_steps_left_ = 0;
  after_impact_ = false;
  first_order_steps_ = 0;
  // In an established contact, rounding may put the place before the start on either side of the surface.
  if (past.q_k1 == start.q || start.contact_established) return;
  if (solve.timed()) solve.g().set_time({start.time_s, period_s_});
  // The κ of (26) without B and K_v. Any other would do, since only the geometry matters here.
  const V reached = solve.g()(0.5 * parabola_.kappa, past.q_k1, start.q);
  if (reached == past.q_k1 || !reached.allFinite()) return;
  past.q_k1 = reached;
  restart_steps_left_ = 1;
}

template <int N>
ProxyFault Bdf2<N>::step(const ProxyHistory<N>& past, const V& h_k, const V& q_ref, const ProxySolver<N>& solve,
                         ProxyTrial<N>& out) noexcept {
  const V h = matched_labels_ && past.has_h_k1 ? V(2.0 * h_k - past.h_k1) : h_k;
  const Given given{past, h, q_ref, solve};
  bool again = restart_steps_left_ > 0 || period_s_ != past.period_k1_s;
  bool changed = false;
  ContactSet now;
  if (!again) {
    const ProxyFault fault = look_back(given, out, now, changed);
    if (fault != ProxyFault::none) return fault;
    again = changed;
  }
  if (again) {
    const ProxyFault fault = restart(given, out, now, changed);
    if (fault != ProxyFault::none) return fault;
  }
  contacts_ = now;
  return ProxyFault::none;
}

// The step of BDF2 proper, with the header's equations and q₁ factored out of p̂'s brackets. `now`: the contacts that
// the step ends with. `event`: an event lies in the step, which must not be taken.
//
// 𝒢 is first evaluated from the true q₁, to see whether the way from there meets something and whether the contacts are
// still those of the step before. If nothing acts on the proxy from there, this is the step.
template <int N>
ProxyFault Bdf2<N>::look_back(const Given& given, ProxyTrial<N>& out, ContactSet& now, bool& event) noexcept {
  const ProxyHistory<N>& past = given.past;
  const V& q_k1 = past.q_k1;
  const V move = q_k1 - past.q_k2, q_tilde = q_k1 + (1.0 / 3.0) * move;
  out.kappa = bdf2_.kappa;
  V ahead = bdf2_.of_move * move + bdf2_.of_v1 * past.v_k1 + bdf2_.of_v2 * past.v_k2 + bdf2_.compliance * given.h;
  if (bdf2_.of_reference > 0.0) ahead += bdf2_.of_reference * (given.q_ref - q_k1);
  out.p_hat = q_k1 + ahead;

  models::GeometricAlgorithm<N>& g = given.solve.g();
  const std::uint64_t unresolved = g.unresolved_steps();
  ProxyFault fault = given.solve(out, q_k1, period_s_);
  if (fault != ProxyFault::none) return fault;
  out.held = out.q == q_k1 && out.p_hat != q_k1;
  const auto contacts = g.contacts();
  set_contacts(now, contacts, out.held);
  event = g.unresolved_steps() != unresolved || (contacts_.known && !same(contacts_, now));
  const bool free = contacts.empty() && out.q == out.p_hat;
  if (!event && !free) fault = from_ahead(given, q_tilde, unresolved, out, now, event);
  out.v = (0.5 * rate_Hz_) * (3.0 * (out.q - q_k1) - move);
  return fault;
}

// The step from q̃, after the one from q₁, which `out` and `now` hold. It must have the same contacts, each from the
// same side, since q̃ may lie beyond a wall that holds from both. `unresolved`: 𝒢's count of unresolved steps before.
template <int N>
ProxyFault Bdf2<N>::from_ahead(const Given& given, const V& q_tilde, std::uint64_t unresolved, ProxyTrial<N>& out,
                               ContactSet& now, bool& event) noexcept {
  models::GeometricAlgorithm<N>& g = given.solve.g();
  const double law_period_s = 2.0 / 3.0 * period_s_;
  const V from_q1 = out.q;
  const ContactSet contacts_from_q1 = now;
  std::array<V, max_contacts> normals;
  const auto held_from_q1 = g.contacts();
  for (std::size_t i = 0; i < now.count; ++i) normals[i] = held_from_q1[i].normal;

  const ProxyFault fault = given.solve(out, q_tilde, law_period_s);
  if (fault != ProxyFault::none) return fault;
  out.held = out.q == q_tilde && out.p_hat != q_tilde;
  const auto contacts = g.contacts();
  set_contacts(now, contacts, out.held);
  event = g.unresolved_steps() != unresolved || !same(contacts_from_q1, now) ||
          !same_sides(contacts_from_q1, normals, contacts);
  if (event || (contacts.empty() && out.q == out.p_hat)) return ProxyFault::none;

  // Behind a mesh where another object holds in the same way, q̃ would lead on behind it. So if the result differs from
  // that from q₁ by more than a thousandth of the way, it must be reachable from q₁.
  if (!((out.q - from_q1).norm() > 1e-3 * (from_q1 - given.past.q_k1).norm())) return ProxyFault::none;
  event = !in_reach(given, out);
  if (event) return ProxyFault::none;
  return given.solve(out, q_tilde, law_period_s);  // repeated so that 𝒢's contacts are this step's
}

// Whether the proxy can get from q₁ to out.q. κ is so large that no medium matters, so only the way is tested.
template <int N>
bool Bdf2<N>::in_reach(const Given& given, const ProxyTrial<N>& out) noexcept {
  ProxyTrial<N> way{.kappa = 1e15 * out.kappa, .p_hat = out.q, .q = out.q, .v = out.v, .f = out.f};
  return given.solve(way, given.past.q_k1, period_s_) == ProxyFault::none &&
         (way.q - out.q).norm() <= 1e-9 * (1.0 + out.q.template lpNorm<1>());
}

// A step at an event or soon after one, by Euler or along the parabola; the header tells which and why. `changed`: the
// contacts changed in the step that look_back() tried, and `now` is what they changed to.
template <int N>
ProxyFault Bdf2<N>::restart(const Given& given, ProxyTrial<N>& out, ContactSet& now, bool changed) noexcept {
  const auto step = [&](ProxyFault (Bdf2::*by)(const Given&, ProxyTrial<N>&)) {
    const ProxyFault fault = (this->*by)(given, out);
    if (fault == ProxyFault::none) set_contacts(now, given.solve.g().contacts(), out.held);
    return fault;
  };
  bool hits = after_impact_ || !undamped_ || !contacts_.known || (changed && gained(contacts_, now));
  if (!hits) {
    const std::uint64_t unresolved = given.solve.g().unresolved_steps();
    const ProxyFault fault = step(&Bdf2::parabola);
    if (fault != ProxyFault::none) return fault;
    hits = gained(contacts_, now) || given.solve.g().unresolved_steps() != unresolved;
  }
  if (hits) {
    const ProxyFault fault = step(&Bdf2::euler);
    if (fault != ProxyFault::none) return fault;
  }
  const bool event = changed || (contacts_.known && !same(contacts_, now));
  const bool impact = contacts_.known && gained(contacts_, now);
  const int counted_down = restart_steps_left_ > 0 ? restart_steps_left_ - 1 : 1;
  restart_steps_left_ = event ? std::max(impact ? 2 : 1, counted_down) : counted_down;
  after_impact_ = impact || (after_impact_ && restart_steps_left_ > 0);
  ++first_order_steps_;
  return ProxyFault::none;
}

// One step of implicit Euler.
//   M(v − v₁)/T + Bv + K_v(q − q_ref) = h + f,  v = (q − q₁)/T   gives
//   κ = M/T² + B/T + K_v,   p̂ = q₁ + [M v₁/T + K_v(q_ref − q₁) + h]/κ    (B = K_v = 0: q₁ + T v₁ + T²h/M)
// It is (26) except for v₁, which stands for (q₁ − q₂)/T there. With order 2's labels that would be wrong by aT/2.
template <int N>
ProxyFault Bdf2<N>::euler(const Given& given, ProxyTrial<N>& out) noexcept {
  const V& q_k1 = given.past.q_k1;
  out.kappa = euler_.kappa;
  out.p_hat = q_k1 + (euler_.of_v1 * given.past.v_k1 + euler_.of_reference * (given.q_ref - q_k1) +
                      euler_.compliance * given.h);
  const ProxyFault fault = given.solve(out, q_k1, period_s_);
  out.held = out.q == q_k1 && out.p_hat != q_k1;
  out.v = rate_Hz_ * (out.q - q_k1);
  return fault;
}

// One step of constant acceleration, for events without impact: friction sets in or lets go, or a contact ends.
//   q = q₁ + T v₁ + T²(h + f)/(2M)   gives   κ = 2M/T²,   p̂ = q₁ + T v₁ + T²h/(2M),   and v = 2(q − q₁)/T − v₁
// A proxy that sticks stops at most aT²/8 from where its slide would have ended, as with (26); with Euler it is aT²/2.
// Friction only stops the proxy and never reverses it. Not for B and K_v, with which this step would oscillate if they
// are stiff.
template <int N>
ProxyFault Bdf2<N>::parabola(const Given& given, ProxyTrial<N>& out) noexcept {
  const V &q_k1 = given.past.q_k1, &v_k1 = given.past.v_k1;
  out.kappa = parabola_.kappa;
  out.p_hat = q_k1 + (parabola_.of_v1 * v_k1 + parabola_.compliance * given.h);
  const ProxyFault fault = given.solve(out, q_k1, period_s_);
  out.held = out.q == q_k1 && out.p_hat != q_k1;
  const V mean = rate_Hz_ * (out.q - q_k1);
  out.v = 2.0 * mean - v_k1;
  if (out.q != out.p_hat && !(out.v.dot(mean) > 0.0)) out.v.setZero();
  return fault;
}

template <int N>
void Bdf2<N>::set_contacts(ContactSet& set, std::span<const models::Contact<N>> contacts, bool held) noexcept {
  set.held = held;
  set.known = true;
  set.overflow = contacts.size() > max_contacts;
  set.count = std::min(contacts.size(), max_contacts);
  for (std::size_t i = 0; i < set.count; ++i) {
    set.keys[i] = {contacts[i].object, contacts[i].feature, contacts[i].slips};
  }
}

// Whether the normals of the contacts in `set` are within 90° of those in `normals`. A curved surface that turns by
// more in a third of a step is an event, too.
template <int N>
bool Bdf2<N>::same_sides(const ContactSet& set, const std::array<V, max_contacts>& normals,
                         std::span<const models::Contact<N>> contacts) noexcept {
  for (const models::Contact<N>& contact : contacts) {
    for (std::size_t i = 0; i < set.count; ++i) {
      const auto& key = set.keys[i];
      if (key.object == contact.object && key.feature == contact.feature && !(normals[i].dot(contact.normal) > 0.0)) {
        return false;
      }
    }
  }
  return true;
}

// Does `now` hold a contact that `before` doesn't?
template <int N>
bool Bdf2<N>::gained(const ContactSet& before, const ContactSet& now) noexcept {
  for (std::size_t i = 0; i < now.count; ++i) {
    bool found = false;
    for (std::size_t j = 0; j < before.count; ++j) {
      found = found || (now.keys[i].object == before.keys[j].object && now.keys[i].feature == before.keys[j].feature);
    }
    if (!found) return true;
  }
  return now.overflow || before.overflow;
}

template <int N>
bool Bdf2<N>::same(const ContactSet& a, const ContactSet& b) noexcept {
  if (a.overflow || b.overflow || a.count != b.count || a.held != b.held) return false;
  for (std::size_t i = 0; i < a.count; ++i) {
    bool found = false;
    for (std::size_t j = 0; j < b.count; ++j) {
      found = found || (a.keys[i].object == b.keys[j].object && a.keys[i].feature == b.keys[j].feature &&
                        a.keys[i].slips == b.keys[j].slips);
    }
    if (!found) return false;
  }
  return true;
}

template class Bdf2<1>;
template class Bdf2<2>;
template class Bdf2<3>;

}  // namespace proxarm::controller
