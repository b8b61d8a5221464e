#include "controller/admittance_proxy.hpp"

#include <cmath>

#include "controller/option_check.hpp"

namespace proxarm::controller {
void AdmittanceConfig::validate() const {
  require_option(is_positive(mass_kg), "--mass", mass_kg, "kg, above 0");
  require_option(is_not_negative(damping_Ns_per_m), "--damping", damping_Ns_per_m, "Ns/m, 0 or more");
  require_option(is_not_negative(spring_N_per_m), "--spring", spring_N_per_m, "N/m, 0 or more");
  require_option(is_positive(period_s), "--timestep", period_s, "seconds, above 0");
  require_option(is_positive(mass_kg / (period_s * period_s)), "--timestep", period_s,
                 "a time such that M/T² is finite");
  require_option(order == 1 || order == 2, "--order", order, "1 or 2");
}

template <int N>
AdmittanceProxy<N>::AdmittanceProxy(const AdmittanceConfig& config, models::GeometricAlgorithm<N>& g)
    : config_(config), g_(&g) {
  config_.validate();
  timed_ = g.wants_time();
  start({});
}

template <int N>
bool AdmittanceProxy<N>::start(const ProxyStart<N>& start) noexcept {
  if (!start.q.allFinite() || !start.v.allFinite() || !start.a.allFinite() || !std::isfinite(start.time_s)) {
    return false;
  }
  // x(t₀ − T) by x(t) = q₀ + v₀t + ½a₀t². With the label of order 1 (and of order 2 with matched labels), the sample
  // before the first step is the state at t₀ itself; with the plain label of order 2 it is the state at t₀ − T.
  const double T = config_.period_s;
  const bool one_later = config_.order == 2 && !config_.matched_labels;
  const double t1 = one_later ? -T : 0.0, t2 = t1 - T;
  q_k1_ = start.q + t1 * start.v + 0.5 * t1 * t1 * start.a;
  q_k2_ = start.q + t2 * start.v + 0.5 * t2 * t2 * start.a;
  v_k1_ = start.v + t1 * start.a;
  v_k2_ = start.v + t2 * start.a;
  if (config_.order == 1) v_k1_ = (q_k1_ - q_k2_) / T;
  has_h_k1_ = false;
  period_k1_s_ = T;
  q_ref_ = start.q;
  f_.setZero();
  p_hat_ = q_k1_;
  kappa_ = config_.mass_kg / (T * T);
  epoch_s_ = start.time_s + t1;
  steps_ = 0;
  contacts_ = {};
  contacts_.known = !start.contact_established;
  restart_steps_left_ = 0;
  after_impact_ = false;
  first_order_steps_ = 0;
  prepare();
  // In an established contact the place before may be on either side of the surface by rounding.
  if (q_k1_ != start.q && !start.contact_established) go_back(start);
  return true;
}

// The plain label of order 2 begins a period before the start. Where that place can't be reached from the start,
// because an object is in between, the history is no free motion: it begins where 𝒢 leaves it, and without a look
// further back.
template <int N>
void AdmittanceProxy<N>::go_back(const ProxyStart<N>& start) noexcept {
  if (timed_) g_->set_time({start.time_s, config_.period_s});
  const V reached = (*g_)(kappa_, q_k1_, start.q);
  if (reached == q_k1_ || !reached.allFinite()) return;
  q_k1_ = p_hat_ = reached;
  restart_steps_left_ = 1;
}

template <int N>
ProxyFault AdmittanceProxy<N>::step(const V& h) noexcept {
  Trial trial;
  const ProxyFault fault = config_.order == 1 ? verlet(h, trial) : second_order(h, trial);
  if (fault != ProxyFault::none) return h.allFinite() ? fault : ProxyFault::input_not_finite;
  p_hat_ = trial.p_hat;
  kappa_ = trial.kappa;
  f_ = trial.f;
  q_k2_ = q_k1_;
  q_k1_ = trial.q;
  v_k2_ = v_k1_;
  v_k1_ = trial.v;
  h_k1_ = h;
  has_h_k1_ = true;
  period_k1_s_ = config_.period_s;
  ++steps_;
  return ProxyFault::none;
}

// What of the equations below doesn't change from step to step.
template <int N>
void AdmittanceProxy<N>::prepare() noexcept {
  const double M = config_.mass_kg, B = config_.damping_Ns_per_m, K_v = config_.spring_N_per_m;
  const double T = config_.period_s, T_o = period_k1_s_;
  const auto rule = [K_v](double kappa) {
    return Rule{.kappa = kappa, .compliance = 1.0 / kappa, .of_reference = K_v / kappa};
  };
  // (26a) with B and K_v, on two intervals that may differ; κq₁ = [2M/(T(T + T_o)) + B/T + K_v] q₁ is taken out.
  const bool plain = T == T_o && B == 0.0 && K_v == 0.0;
  const double inertia = plain ? M / (T * T) : 2.0 * M / (T * (T + T_o));
  verlet_ = rule(inertia + B / T + K_v);
  verlet_.of_move = inertia * (T / T_o) / verlet_.kappa;
  if (plain) verlet_.compliance = T * T / M;
  plain_ = plain;
  euler_ = rule(M / (T * T) + B / T + K_v);
  euler_.of_v1 = M / T / euler_.kappa;
  parabola_ = {.kappa = 2.0 * M / (T * T), .compliance = 0.5 * T * T / M, .of_v1 = T};
  bdf2_ = rule(9.0 * M / (4.0 * T * T) + 3.0 * B / (2.0 * T) + K_v);
  bdf2_.of_move = (3.0 * M / (4.0 * T * T) + B / (2.0 * T)) / bdf2_.kappa;
  bdf2_.of_v1 = 2.0 * M / T / bdf2_.kappa;
  bdf2_.of_v2 = -0.25 * bdf2_.of_v1;
  prepared_for_s_ = T_o;
  rate_Hz_ = 1.0 / T;
}

// q = 𝒢(κ, p̂, q_previous), with nothing but finite numbers in and out. The history is finite, so whatever else isn't
// shows in p̂.
template <int N>
ProxyFault AdmittanceProxy<N>::solve(Trial& out, const V& q_previous, double law_period_s) noexcept {
  if (!out.p_hat.allFinite()) return ProxyFault::result_not_finite;
  if (timed_) g_->set_time({epoch_s_ + static_cast<double>(steps_ + 1) * config_.period_s, law_period_s});
  out.q = (*g_)(out.kappa, out.p_hat, q_previous);
  out.f = out.kappa * (out.q - out.p_hat);  // (25a); it may overflow although both are finite
  return out.f.allFinite() ? ProxyFault::none : ProxyFault::result_not_finite;
}

// (26), with B and K_v; the header has the equations, also of two intervals that differ.
template <int N>
ProxyFault AdmittanceProxy<N>::verlet(const V& h, Trial& out) noexcept {
  if (prepared_for_s_ != period_k1_s_) prepare();
  out.kappa = verlet_.kappa;
  if (plain_) {
    out.p_hat = 2.0 * q_k1_ - q_k2_ + verlet_.compliance * h;  // (26a)
  } else {
    out.p_hat =
        q_k1_ + (verlet_.of_move * (q_k1_ - q_k2_) + verlet_.of_reference * (q_ref_ - q_k1_) + verlet_.compliance * h);
  }
  const ProxyFault fault = solve(out, q_k1_, config_.period_s);  // (26b)
  out.v = rate_Hz_ * (out.q - q_k1_);
  return fault;
}

// One step of implicit Euler, which needs no q(k−2): where order 2 may not look back.
//   M(v − v₁)/T + Bv + K_v(q − q_ref) = h + f,  v = (q − q₁)/T   gives
//   κ = M/T² + B/T + K_v,   p̂ = q₁ + [M v₁/T + K_v(q_ref − q₁) + h]/κ    (B = K_v = 0: q₁ + T v₁ + T²h/M)
// It is (26) but for v₁, which stands for (q₁ − q₂)/T there: that would be wrong by aT/2 with order 2's labels.
template <int N>
ProxyFault AdmittanceProxy<N>::euler(const V& h, Trial& out) noexcept {
  out.kappa = euler_.kappa;
  out.p_hat = q_k1_ + (euler_.of_v1 * v_k1_ + euler_.of_reference * (q_ref_ - q_k1_) + euler_.compliance * h);
  const ProxyFault fault = solve(out, q_k1_, config_.period_s);
  out.held = out.q == q_k1_ && out.p_hat != q_k1_;
  out.v = rate_Hz_ * (out.q - q_k1_);
  return fault;
}

// One step of constant acceleration, which needs no q(k−2) either, where nothing hits: friction sets in or lets go, a
// contact ends.
//   q = q₁ + T v₁ + T²(h + f)/(2M)   gives   κ = 2M/T²,   p̂ = q₁ + T v₁ + T²h/(2M),   and v = 2(q − q₁)/T − v₁
// Stick loses a T²/8 at most of what is left of a slide, as in (26); with Euler it is a T²/2. Friction stops and
// doesn't turn round. Not for B and K_v, which this would let ring where they are stiff.
template <int N>
ProxyFault AdmittanceProxy<N>::parabola(const V& h, Trial& out) noexcept {
  out.kappa = parabola_.kappa;
  out.p_hat = q_k1_ + (parabola_.of_v1 * v_k1_ + parabola_.compliance * h);
  const ProxyFault fault = solve(out, q_k1_, config_.period_s);
  out.held = out.q == q_k1_ && out.p_hat != q_k1_;
  const V mean = rate_Hz_ * (out.q - q_k1_);
  out.v = 2.0 * mean - v_k1_;
  if (out.q != out.p_hat && !(out.v.dot(mean) > 0.0)) out.v.setZero();
  return fault;
}

// BDF2: v = (3q − 4q₁ + q₂)/(2T), and a = (3v − 4v₁ + v₂)/(2T), in Ma + Bv + K_v(q − q_ref) = h + f:
//   κ = 9M/(4T²) + 3B/(2T) + K_v,   q̃ = (4q₁ − q₂)/3   (so that v = (q − q̃)/(2T/3): 𝒢's previous proxy, and its T)
//   p̂ = [M(12q₁ − 3q₂ + 2T(4v₁ − v₂))/(4T²) + (3B/2T) q̃ + K_v q_ref + h]/κ,   q = 𝒢(κ, p̂, q̃)
// below with q₁ taken out of the brackets. Before that, 𝒢 is asked from the true q₁: whether the way from there meets
// something, and whether the contacts are still those of the step before. Where nothing acts on it from there, that is
// the step. Else the answer from q̃ must have the same contacts, each from the same side: q̃ may lie beyond a wall that
// holds from both. A step for which 𝒢 has no answer that keeps its laws is an event, too.
// `now`: the contacts that the step ends with.
template <int N>
ProxyFault AdmittanceProxy<N>::bdf2(const V& h, Trial& out, ContactSet& now, bool& contacts_changed) noexcept {
  const double T = config_.period_s;
  const V move = q_k1_ - q_k2_, q_tilde = q_k1_ + (1.0 / 3.0) * move;
  out.kappa = bdf2_.kappa;
  V ahead = bdf2_.of_move * move + bdf2_.of_v1 * v_k1_ + bdf2_.of_v2 * v_k2_ + bdf2_.compliance * h;
  if (bdf2_.of_reference > 0.0) ahead += bdf2_.of_reference * (q_ref_ - q_k1_);
  out.p_hat = q_k1_ + ahead;
  contacts_changed = false;
  const std::uint64_t unresolved = g_->unresolved_steps();
  ContactSet from_q1;
  std::array<V, max_contacts> normals;  // of from_q1
  V first = q_k1_;                      // the answer from q₁
  for (const bool from_q_tilde : {false, true}) {
    const V& from = from_q_tilde ? q_tilde : q_k1_;
    const ProxyFault fault = solve(out, from, from_q_tilde ? 2.0 / 3.0 * T : T);
    if (fault != ProxyFault::none) return fault;
    out.held = out.q == from && out.p_hat != from;
    const auto contacts = g_->contacts();
    const bool free = contacts.empty() && out.q == out.p_hat;
    set_contacts(now, contacts, out.held);
    const bool changed = from_q_tilde ? !same(from_q1, now) || !same_sides(from_q1, normals, contacts)
                                      : contacts_.known && !same(contacts_, now);
    if (g_->unresolved_steps() != unresolved || changed) {
      contacts_changed = true;
      return ProxyFault::none;
    }
    if (free) break;
    if (from_q_tilde) {
      // Behind a mesh, beside another object that holds the same way there, q̃ leads on behind it: an answer that isn't
      // all but that from q₁ must be in reach from there.
      if (!((out.q - first).norm() > 1e-3 * (first - q_k1_).norm())) break;
      if (!in_reach(out)) {
        contacts_changed = true;
        return ProxyFault::none;
      }
      const ProxyFault again = solve(out, from, 2.0 / 3.0 * T);  // its contacts are the step's
      if (again != ProxyFault::none) return again;
      break;
    }
    first = out.q;
    from_q1 = now;
    for (std::size_t i = 0; i < now.count; ++i) normals[i] = contacts[i].normal;
  }
  out.v = (0.5 * rate_Hz_) * (3.0 * (out.q - q_k1_) - move);
  return ProxyFault::none;
}

// Whether q₁ leads to out.q, so stiffly held that no medium counts.
template <int N>
bool AdmittanceProxy<N>::in_reach(const Trial& out) noexcept {
  Trial way{.kappa = 1e15 * out.kappa, .p_hat = out.q, .q = out.q, .v = out.v, .f = out.f};
  return solve(way, q_k1_, config_.period_s) == ProxyFault::none &&
         (way.q - out.q).norm() <= 1e-9 * (1.0 + out.q.template lpNorm<1>());
}

// BDF2 must not look back across an event. An impact is stepped by Euler: BDF2 would rebound where (26) doesn't, and
// the velocity of that very step still holds part of the approach, so that two more such steps give a clean history. A
// change of stick and slip and a release are stepped along the parabola, and so is one more step after them.
template <int N>
ProxyFault AdmittanceProxy<N>::second_order(const V& h_k, Trial& out) noexcept {
  const V h = config_.matched_labels && has_h_k1_ ? V(2.0 * h_k - h_k1_) : h_k;
  bool again = restart_steps_left_ > 0 || config_.period_s != period_k1_s_;
  bool changed = false;
  ContactSet now;
  if (!again) {
    const ProxyFault fault = bdf2(h, out, now, changed);
    if (fault != ProxyFault::none) return fault;
    again = changed;
  }
  if (again) {
    const ProxyFault fault = restart(h, out, now, changed);
    if (fault != ProxyFault::none) return fault;
  }
  contacts_ = now;
  return ProxyFault::none;
}

template <int N>
ProxyFault AdmittanceProxy<N>::restart(const V& h, Trial& out, ContactSet& now, bool changed) noexcept {
  const auto step = [&](ProxyFault (AdmittanceProxy::*by)(const V&, Trial&)) {
    const ProxyFault fault = (this->*by)(h, out);
    if (fault == ProxyFault::none) set_contacts(now, g_->contacts(), out.held);
    return fault;
  };
  const bool plain = config_.damping_Ns_per_m == 0.0 && config_.spring_N_per_m == 0.0;
  bool hits = after_impact_ || !plain || !contacts_.known || (changed && gained(contacts_, now));
  if (!hits) {
    const std::uint64_t unresolved = g_->unresolved_steps();
    const ProxyFault fault = step(&AdmittanceProxy::parabola);
    if (fault != ProxyFault::none) return fault;
    hits = gained(contacts_, now) || g_->unresolved_steps() != unresolved;
  }
  if (hits) {
    const ProxyFault fault = step(&AdmittanceProxy::euler);
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

template <int N>
void AdmittanceProxy<N>::set_contacts(ContactSet& set, std::span<const models::Contact<N>> contacts,
                                      bool held) noexcept {
  set.held = held;
  set.known = true;
  set.overflow = contacts.size() > max_contacts;
  set.count = std::min(contacts.size(), max_contacts);
  for (std::size_t i = 0; i < set.count; ++i) {
    set.keys[i] = {contacts[i].object, contacts[i].feature, contacts[i].slips};
  }
}

// Are the normals of the contacts that are in `set` within 90° of those there? A curved surface that turns by more in a
// third of a step is an event as well.
template <int N>
bool AdmittanceProxy<N>::same_sides(const ContactSet& set, const std::array<V, max_contacts>& normals,
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
bool AdmittanceProxy<N>::gained(const ContactSet& before, const ContactSet& now) noexcept {
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
bool AdmittanceProxy<N>::same(const ContactSet& a, const ContactSet& b) noexcept {
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

template <int N>
bool AdmittanceProxy<N>::set_mass(double mass_kg) noexcept {
  if (!is_positive(mass_kg)) return false;
  config_.mass_kg = mass_kg;
  prepare();
  return true;
}

template <int N>
bool AdmittanceProxy<N>::set_damping(double damping_Ns_per_m) noexcept {
  if (!is_not_negative(damping_Ns_per_m)) return false;
  config_.damping_Ns_per_m = damping_Ns_per_m;
  prepare();
  return true;
}

template <int N>
bool AdmittanceProxy<N>::set_spring(double spring_N_per_m) noexcept {
  if (!is_not_negative(spring_N_per_m)) return false;
  config_.spring_N_per_m = spring_N_per_m;
  prepare();
  return true;
}

template <int N>
bool AdmittanceProxy<N>::set_reference(const V& q_ref) noexcept {
  if (!q_ref.allFinite()) return false;
  q_ref_ = q_ref;
  return true;
}

template <int N>
bool AdmittanceProxy<N>::set_period(double period_s) noexcept {
  if (!is_positive(period_s)) return false;
  epoch_s_ = time_s();
  steps_ = 0;
  config_.period_s = period_s;
  prepare();
  return true;
}

template class AdmittanceProxy<1>;
template class AdmittanceProxy<2>;
template class AdmittanceProxy<3>;

}  // namespace proxarm::controller
