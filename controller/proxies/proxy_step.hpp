// Contains the parts of a proxy's step that all methods share: parameters, history, p̂ as a weighted sum of the
// history, and the evaluation of 𝒢.
//
// All vectors are in one frame. Units: metres, newtons, seconds. N = 1, 2 or 3.
#pragma once

#include <cstdint>

#include "models/geometry/geometric_algorithm.hpp"
#include "models/geometry/geometry.hpp"

namespace proxarm::controller {

struct AdmittanceConfig {
  double mass_kg = 4.0;           // M of (26), > 0: the felt mass less the handle's mass
  double damping_Ns_per_m = 0.0;  // B ≥ 0
  double spring_N_per_m = 0.0;    // K_v ≥ 0, to the reference (set_reference()); the first one is the start position
  double period_s = 1e-3;         // T, > 0
  int order = 1;                  // 1: the paper's (26). 2: (26) with forces weighted over steps (force_weights.hpp)

  // Throws description::SetupError with the option's name.
  void validate() const;
};

enum class ProxyFault : std::uint8_t {
  none,
  input_not_finite,   // force (admittance), position (impedance) or torque was NaN or infinite
  result_not_finite,  // the input was finite, but p̂ overflowed or 𝒢 returned a value that isn't finite
  squeezed,           // moving objects left the proxy no room (RenderedWorld)
};

// The state at the start of a motion, at time t₀.
template <int N>
struct ProxyStart {
  models::Vec<N> q = models::Vec<N>::Zero();
  models::Vec<N> v = models::Vec<N>::Zero();
  models::Vec<N> a = models::Vec<N>::Zero();
  double time_s = 0.0;
  // For order 2: the contacts of the first step existed before it, so this step is no impact, and `a` includes the
  // contacts' forces.
  bool contact_established = false;
};

// The history that a step uses. Precondition of a step: all values are finite.
template <int N>
struct ProxyHistory {
  models::Vec<N> q_k1 = models::Vec<N>::Zero(), q_k2 = models::Vec<N>::Zero();  // q(k−1), q(k−2)
  models::Vec<N> v_k1 = models::Vec<N>::Zero();  // mean velocity from q(k−2) to q(k−1)
  double period_k1_s = 0.0;                      // time from q(k−2) to q(k−1)
};

// Coefficients of (26) from M, B, K_v and T:
//   p̂ = q₁ + of_move (q₁ − q₂) + of_reference (q_ref − q₁) + compliance h
struct ProxyRule {
  double kappa = 0.0, compliance = 0.0;  // κ, 1/κ
  double of_move = 0.0, of_reference = 0.0;
  bool plain = true;  // no B, no K_v, equal intervals: (26a) as in the paper
};

// Result of a trial step. The proxy takes it over unless the step has a fault.
template <int N>
struct ProxyTrial {
  double kappa = 0.0;
  models::Vec<N> p_hat, q, f;
};

// Evaluates q = 𝒢(κ, p̂, q_previous), and checks that p̂ and the results are finite.
template <int N>
class ProxySolver {
 public:
  explicit ProxySolver(models::GeometricAlgorithm<N>& g) : g_(&g), timed_(g.wants_time()) {}

  // Whether 𝒢 depends on time; then set_time() must be called before each step.
  [[nodiscard]] bool timed() const noexcept { return timed_; }
  // Sets the time label of the next q(k).
  void set_time(double time_s) noexcept { time_s_ = time_s; }
  [[nodiscard]] models::GeometricAlgorithm<N>& g() const noexcept { return *g_; }

  // Computes trial.q and trial.f from trial.kappa and trial.p_hat. law_period_s: the time of the motion from q_previous
  // to trial.q, for 𝒢's velocity laws. Precondition: q_previous is finite. Other values needn't be finite, since p̂
  // then isn't finite either.
  ProxyFault operator()(ProxyTrial<N>& trial, const models::Vec<N>& q_previous, double law_period_s) const noexcept {
    if (!trial.p_hat.allFinite()) return ProxyFault::result_not_finite;
    if (timed_) g_->set_time({time_s_, law_period_s});
    trial.q = (*g_)(trial.kappa, trial.p_hat, q_previous);
    trial.f = trial.kappa * (trial.q - trial.p_hat);  // (25a); may overflow although q and p̂ are finite
    return trial.f.allFinite() ? ProxyFault::none : ProxyFault::result_not_finite;
  }

 private:
  models::GeometricAlgorithm<N>* g_;
  bool timed_;
  double time_s_ = 0.0;
};

// Computes one step of (26) under the force h, after the history `past`. period_s: T.
template <int N>
ProxyFault step_of_26(const ProxyRule& rule, const ProxyHistory<N>& past, const models::Vec<N>& h,
                      const models::Vec<N>& q_ref, double period_s, const ProxySolver<N>& solve,
                      ProxyTrial<N>& out) noexcept {
  const models::Vec<N>&q_k1 = past.q_k1, &q_k2 = past.q_k2;
  out.kappa = rule.kappa;
  if (rule.plain) {
    out.p_hat = 2.0 * q_k1 - q_k2 + rule.compliance * h;  // (26a)
  } else {
    out.p_hat = q_k1 + (rule.of_move * (q_k1 - q_k2) + rule.of_reference * (q_ref - q_k1) + rule.compliance * h);
  }
  return solve(out, q_k1, period_s);  // (26b)
}

}  // namespace proxarm::controller
