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
  euler_steps_left_ = 0;
  first_order_steps_ = 0;
  return true;
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

// q = 𝒢(κ, p̂, q_previous), with nothing but finite numbers in and out. The history is finite, so whatever else isn't
// shows in p̂.
template <int N>
ProxyFault AdmittanceProxy<N>::solve(Trial& out, const V& q_previous, double law_period_s) noexcept {
  if (!out.p_hat.allFinite()) return ProxyFault::result_not_finite;
  g_->set_time({epoch_s_ + static_cast<double>(steps_ + 1) * config_.period_s, law_period_s});
  out.q = (*g_)(out.kappa, out.p_hat, q_previous);
  out.held = config_.order == 2 && out.q == q_previous && out.p_hat != q_previous;
  out.f = out.kappa * (out.q - out.p_hat);  // (25a); it may overflow although both are finite
  return out.f.allFinite() ? ProxyFault::none : ProxyFault::result_not_finite;
}

template <int N>
ProxyFault AdmittanceProxy<N>::verlet(const V& h, Trial& out) noexcept {
  const double M = config_.mass_kg, B = config_.damping_Ns_per_m, K_v = config_.spring_N_per_m;
  const double T = config_.period_s, T_o = period_k1_s_;
  if (T == T_o && B == 0.0 && K_v == 0.0) {
    out.p_hat = 2.0 * q_k1_ - q_k2_ + T * T * h / M;  // (26a)
    out.kappa = M / (T * T);
  } else {
    // (26a) with B and K_v, on two intervals that may differ. The header's p̂, with q₁ taken out of the brackets so that
    // equal positions cancel exactly: κq₁ = [2M/(T(T + T_o)) + B/T + K_v] q₁.
    const double inertia = 2.0 * M / (T * (T + T_o));
    out.kappa = inertia + B / T + K_v;
    out.p_hat = q_k1_ + (inertia * (T / T_o) * (q_k1_ - q_k2_) + K_v * (q_ref_ - q_k1_) + h) / out.kappa;
  }
  const ProxyFault fault = solve(out, q_k1_, T);  // (26b)
  out.v = (out.q - q_k1_) / T;
  return fault;
}

// One step of implicit Euler, which needs no q(k−2): where order 2 may not look back.
//   M(v − v₁)/T + Bv + K_v(q − q_ref) = h + f,  v = (q − q₁)/T   gives
//   κ = M/T² + B/T + K_v,   p̂ = q₁ + [M v₁/T + K_v(q_ref − q₁) + h]/κ    (B = K_v = 0: q₁ + T v₁ + T²h/M)
// It is (26) but for v₁, which stands for (q₁ − q₂)/T there: that would be wrong by aT/2 with order 2's labels.
template <int N>
ProxyFault AdmittanceProxy<N>::euler(const V& h, Trial& out) noexcept {
  const double M = config_.mass_kg, B = config_.damping_Ns_per_m, K_v = config_.spring_N_per_m, T = config_.period_s;
  out.kappa = M / (T * T) + B / T + K_v;
  out.p_hat = q_k1_ + (M / T * v_k1_ + K_v * (q_ref_ - q_k1_) + h) / out.kappa;
  const ProxyFault fault = solve(out, q_k1_, T);
  out.v = (out.q - q_k1_) / T;
  return fault;
}

// BDF2: v = (3q − 4q₁ + q₂)/(2T), and a = (3v − 4v₁ + v₂)/(2T), in Ma + Bv + K_v(q − q_ref) = h + f:
//   κ = 9M/(4T²) + 3B/(2T) + K_v,   q̃ = (4q₁ − q₂)/3   (so that v = (q − q̃)/(2T/3): 𝒢's previous proxy, and its T)
//   p̂ = [M(12q₁ − 3q₂ + 2T(4v₁ − v₂))/(4T²) + (3B/2T) q̃ + K_v q_ref + h]/κ,   q = 𝒢(κ, p̂, q̃)
// below with q₁ taken out of the brackets. Before that, 𝒢 is asked from the true q₁: whether the way from there meets
// something (q̃ may lie beyond a thin wall), and whether the contacts are still those of the step before. Where nothing
// acts on it from there, that is the step. A step for which 𝒢 has no answer that keeps its laws is an event, too.
template <int N>
ProxyFault AdmittanceProxy<N>::bdf2(const V& h, Trial& out, bool& contacts_changed) noexcept {
  const double M = config_.mass_kg, B = config_.damping_Ns_per_m, K_v = config_.spring_N_per_m, T = config_.period_s;
  const V q_tilde = q_k1_ + (q_k1_ - q_k2_) / 3.0;
  const V inertial = M / (4.0 * T * T) * (3.0 * (q_k1_ - q_k2_) + 2.0 * T * (4.0 * v_k1_ - v_k2_));
  out.kappa = 9.0 * M / (4.0 * T * T) + 3.0 * B / (2.0 * T) + K_v;
  out.p_hat = q_k1_ + (inertial + 3.0 * B / (2.0 * T) * (q_tilde - q_k1_) + K_v * (q_ref_ - q_k1_) + h) / out.kappa;
  contacts_changed = false;
  const std::uint64_t unresolved = g_->unresolved_steps();
  for (const bool from_q_tilde : {false, true}) {
    const ProxyFault fault = from_q_tilde ? solve(out, q_tilde, 2.0 * T / 3.0) : solve(out, q_k1_, T);
    if (fault != ProxyFault::none) return fault;
    if (g_->unresolved_steps() != unresolved ||
        (contacts_.known && !same(contacts_, contact_set(g_->contacts(), out.held)))) {
      contacts_changed = true;
      return ProxyFault::none;
    }
    if (out.q == out.p_hat && g_->contacts().empty()) break;
  }
  out.v = (3.0 * (out.q - q_k1_) - (q_k1_ - q_k2_)) / (2.0 * T);
  return ProxyFault::none;
}

// Across an impact BDF2 must not be used: it would rebound where (26) doesn't. A change of the contact set, of stick
// and slip, and a release are done again by Euler. The velocity of that very step still holds part of the approach, so
// after a new contact two more Euler steps give a clean history; after the others one does.
template <int N>
ProxyFault AdmittanceProxy<N>::second_order(const V& h_k, Trial& out) noexcept {
  const V h = config_.matched_labels && has_h_k1_ ? V(2.0 * h_k - h_k1_) : h_k;
  bool again = euler_steps_left_ > 0 || config_.period_s != period_k1_s_;
  bool changed = false;
  if (!again) {
    const ProxyFault fault = bdf2(h, out, changed);
    if (fault != ProxyFault::none) return fault;
    again = changed;
  }
  if (again) {
    const ProxyFault fault = euler(h, out);
    if (fault != ProxyFault::none) return fault;
  }
  const ContactSet now = contact_set(g_->contacts(), out.held);
  if (again) {
    const bool event = changed || (contacts_.known && !same(contacts_, now));
    const int after_event = contacts_.known && gained(contacts_, now) ? 2 : 1;
    const int counted_down = euler_steps_left_ > 0 ? euler_steps_left_ - 1 : 1;
    euler_steps_left_ = event && after_event > counted_down ? after_event : counted_down;
    ++first_order_steps_;
  }
  contacts_ = now;
  return ProxyFault::none;
}

template <int N>
typename AdmittanceProxy<N>::ContactSet AdmittanceProxy<N>::contact_set(std::span<const models::Contact<N>> contacts,
                                                                        bool held) noexcept {
  ContactSet set;
  set.held = held;
  set.overflow = contacts.size() > max_contacts;
  for (const auto& contact : contacts) {
    if (set.count == max_contacts) break;
    set.keys[set.count++] = {contact.object, contact.feature, contact.slips};
  }
  return set;
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
  return true;
}

template <int N>
bool AdmittanceProxy<N>::set_damping(double damping_Ns_per_m) noexcept {
  if (!is_not_negative(damping_Ns_per_m)) return false;
  config_.damping_Ns_per_m = damping_Ns_per_m;
  return true;
}

template <int N>
bool AdmittanceProxy<N>::set_spring(double spring_N_per_m) noexcept {
  if (!is_not_negative(spring_N_per_m)) return false;
  config_.spring_N_per_m = spring_N_per_m;
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
  return true;
}

template class AdmittanceProxy<1>;
template class AdmittanceProxy<2>;
template class AdmittanceProxy<3>;

}  // namespace proxarm::controller
