#include "controller/proxies/admittance_proxy.hpp"

#include <cmath>

#include "models/base/option_check.hpp"

namespace proxarm::controller {

template <int N>
AdmittanceProxy<N>::AdmittanceProxy(const AdmittanceConfig& config, models::GeometricAlgorithm<N>& g)
    : config_(config), solve_(g) {
  config_.validate();
  start({});
}

template <int N>
bool AdmittanceProxy<N>::start(const ProxyStart<N>& start) noexcept {
  if (!start.q.allFinite() || !start.v.allFinite() || !start.a.allFinite() || !std::isfinite(start.time_s)) {
    return false;
  }
  // q(t₀ − T) by q(t) = q₀ + v₀t + ½a₀t². With the label of order 1 (and of order 2 with matched labels), the sample
  // before the first step is the state at t₀ itself; with the plain label of order 2 it is the state at t₀ − T.
  const double T = config_.period_s;
  const bool one_later = config_.order == 2 && !config_.matched_labels;
  const double t1 = one_later ? -T : 0.0, t2 = t1 - T;
  past_ = {};
  past_.q_k1 = start.q + t1 * start.v + 0.5 * t1 * t1 * start.a;
  past_.q_k2 = start.q + t2 * start.v + 0.5 * t2 * t2 * start.a;
  past_.v_k1 = start.v + t1 * start.a;
  past_.v_k2 = start.v + t2 * start.a;
  if (config_.order == 1) past_.v_k1 = (past_.q_k1 - past_.q_k2) / T;
  past_.period_k1_s = T;
  q_ref_ = start.q;
  f_.setZero();
  kappa_ = config_.mass_kg / (T * T);
  epoch_s_ = start.time_s + t1;
  steps_ = 0;
  prepare();
  bdf2_.start(start, solve_, past_);
  p_hat_ = past_.q_k1;
  return true;
}

template <int N>
void AdmittanceProxy<N>::follow(const AdmittanceProxy& other) noexcept {
  const ProxySolver<N> own = solve_;
  *this = other;
  solve_ = own;
  if (solve_.timed()) solve_.g().set_time({time_s(), config_.period_s});
}

template <int N>
ProxyFault AdmittanceProxy<N>::step(const V& h) noexcept {
  if (solve_.timed()) solve_.set_time(epoch_s_ + static_cast<double>(steps_ + 1) * config_.period_s);
  ProxyTrial<N> trial;
  const ProxyFault fault = config_.order == 1 ? verlet(h, trial) : bdf2_.step(past_, h, q_ref_, solve_, trial);
  if (fault != ProxyFault::none) return h.allFinite() ? fault : ProxyFault::input_not_finite;
  p_hat_ = trial.p_hat;
  kappa_ = trial.kappa;
  f_ = trial.f;
  past_.q_k2 = past_.q_k1;
  past_.q_k1 = trial.q;
  past_.v_k2 = past_.v_k1;
  past_.v_k1 = trial.v;
  past_.h_k1 = h;
  past_.has_h_k1 = true;
  past_.period_k1_s = config_.period_s;
  ++steps_;
  return ProxyFault::none;
}

// (26), with B and K_v. The header has the equations, also for two intervals that differ.
template <int N>
ProxyFault AdmittanceProxy<N>::verlet(const V& h, ProxyTrial<N>& out) noexcept {
  if (prepared_for_s_ != past_.period_k1_s) prepare();
  const V &q_k1 = past_.q_k1, &q_k2 = past_.q_k2;
  out.kappa = verlet_.kappa;
  if (plain_) {
    out.p_hat = 2.0 * q_k1 - q_k2 + verlet_.compliance * h;  // (26a)
  } else {
    out.p_hat =
        q_k1 + (verlet_.of_move * (q_k1 - q_k2) + verlet_.of_reference * (q_ref_ - q_k1) + verlet_.compliance * h);
  }
  const ProxyFault fault = solve_(out, q_k1, config_.period_s);  // (26b)
  out.v = rate_Hz_ * (out.q - q_k1);
  return fault;
}

// Computes what doesn't change from step to step.
template <int N>
void AdmittanceProxy<N>::prepare() noexcept {
  const double M = config_.mass_kg, B = config_.damping_Ns_per_m, K_v = config_.spring_N_per_m;
  const double T = config_.period_s, T_o = past_.period_k1_s;
  // (26a) with B and K_v, for two intervals that may differ. κq₁ = [2M/(T(T + T_o)) + B/T + K_v] q₁ is factored out.
  plain_ = T == T_o && B == 0.0 && K_v == 0.0;
  const double inertia = plain_ ? M / (T * T) : 2.0 * M / (T * (T + T_o));
  verlet_ = ProxyRule::of(inertia + B / T + K_v, K_v);
  verlet_.of_move = inertia * (T / T_o) / verlet_.kappa;
  if (plain_) verlet_.compliance = T * T / M;
  prepared_for_s_ = T_o;
  rate_Hz_ = 1.0 / T;
  bdf2_.prepare(config_);
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
