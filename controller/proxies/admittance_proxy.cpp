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
  // q_k1 is the state at t₀. q_k2 is the state at t₀ − T, by q(t) = q₀ + v₀t + ½a₀t².
  const double T = config_.period_s;
  past_ = {};
  past_.q_k1 = start.q;
  past_.q_k2 = start.q - T * start.v + 0.5 * T * T * start.a;
  past_.v_k1 = (past_.q_k1 - past_.q_k2) / T;
  past_.period_k1_s = T;
  q_ref_ = start.q;
  f_.setZero();
  kappa_ = config_.mass_kg / (T * T);
  epoch_s_ = start.time_s;
  steps_ = 0;
  prepare();
  weights_.start(start, solve_);
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
  if (prepared_for_s_ != past_.period_k1_s) prepare();
  ProxyTrial<N> trial;
  const ProxyFault fault = config_.order == 1 ? step_of_26(verlet_, past_, h, q_ref_, config_.period_s, solve_, trial)
                                              : weights_.step(verlet_, past_, h, q_ref_, solve_, trial);
  if (fault != ProxyFault::none) return h.allFinite() ? fault : ProxyFault::input_not_finite;
  p_hat_ = trial.p_hat;
  kappa_ = trial.kappa;
  f_ = trial.f;
  past_.v_k1 = rate_Hz_ * (trial.q - past_.q_k1);
  const V* came_from = config_.order == 2 ? weights_.came_from() : nullptr;
  past_.q_k2 = came_from != nullptr ? *came_from : past_.q_k1;
  past_.q_k1 = trial.q;
  past_.period_k1_s = config_.period_s;
  ++steps_;
  return ProxyFault::none;
}

// Computes the coefficients that stay constant from step to step.
template <int N>
void AdmittanceProxy<N>::prepare() noexcept {
  const double M = config_.mass_kg, B = config_.damping_Ns_per_m, K_v = config_.spring_N_per_m;
  const double T = config_.period_s, T_o = past_.period_k1_s;
  // The coefficients are those of (26a) with B and K_v, for two intervals that may be unequal.
  // κq₁ = [2M/(T(T + T_o)) + B/T + K_v] q₁ is factored out.
  verlet_ = {};
  verlet_.plain = T == T_o && B == 0.0 && K_v == 0.0;
  const double inertia = verlet_.plain ? M / (T * T) : 2.0 * M / (T * (T + T_o));
  verlet_.kappa = inertia + B / T + K_v;
  verlet_.compliance = verlet_.plain ? T * T / M : 1.0 / verlet_.kappa;
  verlet_.of_move = inertia * (T / T_o) / verlet_.kappa;
  verlet_.of_reference = K_v / verlet_.kappa;
  prepared_for_s_ = T_o;
  rate_Hz_ = 1.0 / T;
  weights_.prepare(config_);
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
  weights_.forget_forces();
  prepare();
  return true;
}

template class AdmittanceProxy<1>;
template class AdmittanceProxy<2>;
template class AdmittanceProxy<3>;

}  // namespace proxarm::controller
