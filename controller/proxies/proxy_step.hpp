// What one step of a proxy is made of, whichever method computes it: its parameters, the motion that it looks back on,
// p̂ as a weighted sum of that motion, and the question to 𝒢.
//
// All vectors in one frame, metres, newtons, seconds. n = 1, 2 or 3.
#pragma once

#include <cstdint>

#include "models/geometry/geometric_algorithm.hpp"
#include "models/geometry/geometry.hpp"

namespace proxarm::controller {

struct AdmittanceConfig {
  double mass_kg = 4.0;           // M of (26), > 0: what the hand feels less the handle after the sensor
  double damping_Ns_per_m = 0.0;  // B ≥ 0
  double spring_N_per_m = 0.0;    // K_v ≥ 0, towards the reference (set_reference(); at first the start position)
  double period_s = 1e-3;         // T, > 0
  int order = 1;                  // 1: the paper's (26). 2: BDF2
  bool matched_labels = false;    // order 2 only: q(k) stands for t_{k+1}, as at order 1

  // Throws description::SetupError that names the option.
  void validate() const;
};

enum class ProxyFault : std::uint8_t {
  none,
  input_not_finite,   // the force (admittance), position (impedance) or torque was NaN or infinite
  result_not_finite,  // finite input, but p̂ left the range of double, or 𝒢 returned something that isn't finite
  squeezed,           // objects that move left no room (RenderedWorld)
};

// Where a motion starts, at time t₀.
template <int N>
struct ProxyStart {
  models::Vec<N> q = models::Vec<N>::Zero();
  models::Vec<N> v = models::Vec<N>::Zero();
  models::Vec<N> a = models::Vec<N>::Zero();
  double time_s = 0.0;
  // Order 2: the contacts of the first step were there before it, so it is no impact.
  bool contact_established = false;
};

// What a step looks back on; finite throughout.
template <int N>
struct ProxyHistory {
  models::Vec<N> q_k1 = models::Vec<N>::Zero(), q_k2 = models::Vec<N>::Zero();  // q(k−1), q(k−2)
  models::Vec<N> v_k1 = models::Vec<N>::Zero(), v_k2 = models::Vec<N>::Zero();  // their velocities
  models::Vec<N> h_k1 = models::Vec<N>::Zero();                                 // h(k−1)
  bool has_h_k1 = false;
  double period_k1_s = 0.0;  // time between q(k−2) and q(k−1)
};

// What M, B, K_v and T make of
//   p̂ = q₁ + of_move (q₁ − q₂) + of_v1 v₁ + of_v2 v₂ + of_reference (q_ref − q₁) + compliance h
struct ProxyRule {
  double kappa = 0.0, compliance = 0.0;  // κ, 1/κ
  double of_move = 0.0, of_v1 = 0.0, of_v2 = 0.0, of_reference = 0.0;

  // With the spring K_v; the method adds what it takes of the motion.
  static ProxyRule of(double kappa, double K_v) noexcept {
    return {.kappa = kappa, .compliance = 1.0 / kappa, .of_reference = K_v / kappa};
  }
};

// A step that has been tried: the proxy takes it over when no fault came of it.
template <int N>
struct ProxyTrial {
  double kappa = 0.0;
  models::Vec<N> p_hat, q, v, f;
  bool held = false;  // q is bit for bit where it came from although p̂ isn't
};

// The question to 𝒢: q = 𝒢(κ, p̂, q_previous), with nothing but finite numbers in and out.
template <int N>
class ProxySolver {
 public:
  explicit ProxySolver(models::GeometricAlgorithm<N>& g) : g_(&g), timed_(g.wants_time()) {}

  // Whether 𝒢 wants to know the time; if so, set_time() comes before each step.
  [[nodiscard]] bool timed() const noexcept { return timed_; }
  // The time that q(k) of the step to come stands for.
  void set_time(double time_s) noexcept { time_s_ = time_s; }
  [[nodiscard]] models::GeometricAlgorithm<N>& g() const noexcept { return *g_; }

  // From trial.kappa and trial.p_hat to trial.q and trial.f. `law_period_s` is the T that 𝒢's laws of velocity take for
  // the way from `q_previous`. The history is finite, so whatever else isn't shows in p̂.
  ProxyFault operator()(ProxyTrial<N>& trial, const models::Vec<N>& q_previous, double law_period_s) const noexcept {
    if (!trial.p_hat.allFinite()) return ProxyFault::result_not_finite;
    if (timed_) g_->set_time({time_s_, law_period_s});
    trial.q = (*g_)(trial.kappa, trial.p_hat, q_previous);
    trial.f = trial.kappa * (trial.q - trial.p_hat);  // (25a); it may overflow although both are finite
    return trial.f.allFinite() ? ProxyFault::none : ProxyFault::result_not_finite;
  }

 private:
  models::GeometricAlgorithm<N>* g_;
  bool timed_;
  double time_s_ = 0.0;
};

}  // namespace proxarm::controller
