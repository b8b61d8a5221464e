// Computes the force for the actuators from the measured tool position: impedance-type rendering with a 𝒢.
//
// The four laws are those of Kikuuwe and Fujimoto (World Haptics 2007). The paper's experiment (Fig. 5) compares three
// of them:
//   plain          q = 𝒢(K, p, q₁),  f = K(q − p)                                                (1)
//   damped_motion  q = 𝒢(K, p, q₁),  f = K(q − p) + B(∇q − ∇p)/T                                 (5)
//   damped_tool    q = 𝒢(K, p, q₁),  f = K(q − p) − B∇p/T                                        (6)
//   implicit       p̂ = p + B(q₁ − p₁)/(KT + B),  q = 𝒢(K + B/T, p̂, q₁),  f = (K + B/T)(q − p̂)     (23)
// q₁ = q(k−1), p₁ = p(k−1), ∇x = x(k) − x(k−1). p: position of the tool. f: force on the hand. All vectors are in one
// frame. Units: metres, newtons. damped_motion can pull the tool back to an object that it leaves. damped_tool drags
// the tool in free space. implicit does neither.
//
// One caller at a time. step() may be called in the cycle: it doesn't allocate, lock, throw or print.
#pragma once

#include <cmath>
#include <cstdint>

#include "controller/proxies/proxy_step.hpp"
#include "models/base/state_archive.hpp"
#include "models/geometry/geometric_algorithm.hpp"

namespace proxarm::controller {

enum class ImpedanceLaw : std::uint8_t { plain, damped_motion, damped_tool, implicit };

struct ImpedanceConfig {
  double stiffness_N_per_m = 750.0;  // K of the virtual coupling, > 0
  double damping_Ns_per_m = 8.0;     // B ≥ 0; unused by `plain`
  double period_s = 1e-3;            // T, > 0
  ImpedanceLaw law = ImpedanceLaw::implicit;

  // Throws description::SetupError with the option's name.
  void validate() const;
};

template <int N>
class ImpedanceProxy {
 public:
  using V = models::Vec<N>;

  // Validates `config`. Precondition: `g` outlives this proxy, and only this proxy uses `g`.
  ImpedanceProxy(const ImpedanceConfig& config, models::GeometricAlgorithm<N>& g) : config_(config), g_(&g) {
    config_.validate();
  }

  // Starts tool and proxy at rest at p. If p or the time isn't finite, returns false and changes nothing.
  bool start(const V& p, double time_s = 0.0) noexcept {
    if (!p.allFinite() || !std::isfinite(time_s)) return false;
    q_k1_ = p_k1_ = p_hat_ = p;
    f_.setZero();
    epoch_s_ = time_s;
    steps_ = 0;
    return true;
  }

  // Computes one period with the tool measured at p(k). A fault leaves everything unchanged.
  [[nodiscard]] ProxyFault step(const V& p) noexcept {
    if (!p.allFinite()) return ProxyFault::input_not_finite;
    const double K = config_.stiffness_N_per_m, B = config_.damping_Ns_per_m, T = config_.period_s;
    const bool implicit = config_.law == ImpedanceLaw::implicit;
    const double kappa = kappa_N_per_m();
    const V p_hat = implicit ? V(p + B * (q_k1_ - p_k1_) / (K * T + B)) : p;  // (23a)
    if (!p_hat.allFinite()) return ProxyFault::result_not_finite;
    g_->set_time({epoch_s_ + static_cast<double>(steps_) * T, T});
    const V q = (*g_)(kappa, p_hat, q_k1_);                                                    // (1a), (23b)
    V f = kappa * (q - p_hat);                                                                 // (1b), (23c)
    if (config_.law == ImpedanceLaw::damped_motion) f += B * ((q - q_k1_) - (p - p_k1_)) / T;  // (5b)
    if (config_.law == ImpedanceLaw::damped_tool) f -= B * (p - p_k1_) / T;                    // (6b)
    if (!f.allFinite()) return ProxyFault::result_not_finite;
    p_hat_ = p_hat;
    f_ = f;
    p_k1_ = p;
    q_k1_ = q;
    ++steps_;
    return ProxyFault::none;
  }

  [[nodiscard]] const V& q() const noexcept { return q_k1_; }
  [[nodiscard]] const V& f() const noexcept { return f_; }
  [[nodiscard]] const V& p_hat() const noexcept { return p_hat_; }
  // κ, the stiffness passed to 𝒢.
  [[nodiscard]] double kappa_N_per_m() const noexcept {
    const bool implicit = config_.law == ImpedanceLaw::implicit;
    return config_.stiffness_N_per_m + (implicit ? config_.damping_Ns_per_m / config_.period_s : 0.0);
  }
  [[nodiscard]] const ImpedanceConfig& config() const noexcept { return config_; }

  void archive(fieldbus::StateArchive& state) noexcept {
    state(q_k1_, p_k1_, p_hat_, f_, epoch_s_, steps_);
    // A moving object must start the next step, to the bit, at the place where the last step ended.
    if (steps_ > 0) g_->set_time({epoch_s_ + static_cast<double>(steps_ - 1) * config_.period_s, config_.period_s});
  }

 private:
  ImpedanceConfig config_;
  models::GeometricAlgorithm<N>* g_;
  V q_k1_ = V::Zero(), p_k1_ = V::Zero(), p_hat_ = V::Zero(), f_ = V::Zero();
  double epoch_s_ = 0.0;
  std::uint64_t steps_ = 0;
};

}  // namespace proxarm::controller
