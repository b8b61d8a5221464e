// Moves a mass M through a virtual world by the measured force: the paper's admittance-type rendering, eq. (26).
//
// The paper: Kikuuwe and Fujimoto, "Incorporating Geometric Algorithms in Impedance- and Admittance-Type Haptic
// Rendering", Proc. World Haptics 2007. Input: the hand's force h on the sensor. Output: the position q that the drives
// must follow. The world is any 𝒢 (models/geometry/geometric_algorithm.hpp); 𝒢 needs only geometry.
//
//   p̂(k) = 2 q(k−1) − q(k−2) + T² h(k)/M     (26a)
//   q(k) = 𝒢(M/T², p̂(k), q(k−1))             (26b)
//   f(k) = (M/T²)(q(k) − p̂(k))               (25a)   the world's force on the proxy
//
// Three things go beyond the paper and don't change 𝒢:
//   - Damping B and a spring K_v to q_ref. Both are implicit, so they are stable at any size:
//       M∇²q/T² + B∇q/T + K_v(q − q_ref) = h + ℳ(q, ∇q/T)   is (26) with
//       κ = M/T² + B/T + K_v,   p̂ = [M(2q₁ − q₂)/T² + B q₁/T + K_v q_ref + h]/κ,   q₁ = q(k−1), q₂ = q(k−2).
//   - Parameters that change without a jump of position or velocity. M, B, K_v and q_ref change at once. A new T takes
//     one step with two unequal intervals (set_period()).
//   - Order 2: (26) with forces weighted over the last steps (force_weights.hpp).
//
// Time labels: q(k) is computed from h(k) = h(t_k) and is the state at t_{k+1} (Störmer–Verlet, shifted by one sample),
// when the next SYNC makes q(k) effective. start() sets a history that is exact for this label: free motion under a
// constant force follows the parabola to rounding.
//
// All vectors are in one frame. Units: metres, newtons, seconds. N = 1, 2 or 3. One caller at a time. step() and the
// setters may be called in the cycle: they don't allocate, lock, throw or print.
#pragma once

#include <cstdint>

#include "controller/proxies/force_weights.hpp"
#include "controller/proxies/proxy_step.hpp"
#include "models/base/state_archive.hpp"
#include "models/geometry/geometric_algorithm.hpp"
#include "models/geometry/geometry.hpp"

namespace proxarm::controller {

template <int N>
class AdmittanceProxy {
 public:
  using V = models::Vec<N>;

  // Validates `config`. Precondition: `g` outlives this proxy, and only this proxy uses `g`.
  AdmittanceProxy(const AdmittanceConfig& config, models::GeometricAlgorithm<N>& g);

  // Sets the history so that the next step continues the motion q₀ + v₀t + ½a₀t². If a value isn't finite, returns
  // false and changes nothing.
  bool start(const ProxyStart<N>& start) noexcept;

  // Copies state and parameters of `other`, but keeps this proxy's 𝒢, and sets the moving objects of this 𝒢 to the time
  // of `other`.
  void follow(const AdmittanceProxy& other) noexcept;

  // Moves the proxy for one period under the measured force h(k). A fault leaves everything unchanged, so the step may
  // be repeated.
  [[nodiscard]] ProxyFault step(const V& h) noexcept;

  // Results of the last step; before the first step: start position, zero force, p̂ = q. At order 2, f() is the
  // weighted force that accelerated the proxy, and κ and p̂ are the values that give this force by (26).
  [[nodiscard]] const V& q() const noexcept { return past_.q_k1; }
  [[nodiscard]] const V& f() const noexcept { return f_; }
  [[nodiscard]] const V& p_hat() const noexcept { return p_hat_; }
  [[nodiscard]] double kappa_N_per_m() const noexcept { return kappa_; }
  // Mean velocity over the last step.
  [[nodiscard]] const V& velocity() const noexcept { return past_.v_k1; }
  [[nodiscard]] double time_s() const noexcept { return epoch_s_ + static_cast<double>(steps_) * config_.period_s; }

  // The setters act from the next step on. They return false and change nothing if a value is outside the ranges of
  // AdmittanceConfig.
  bool set_mass(double mass_kg) noexcept;
  bool set_damping(double damping_Ns_per_m) noexcept;
  bool set_spring(double spring_N_per_m) noexcept;
  bool set_reference(const V& q_ref) noexcept;
  // Changes the period from T_o to T_n. The next step spans these two intervals. If they are unequal, ∇²q/T² is
  // 2[(q − q₁)/T_n − (q₁ − q₂)/T_o]/(T_n + T_o), so
  //   κ = 2M/(T_n(T_n + T_o)) + B/T_n + K_v,   p̂ = q₁ + [2M(q₁ − q₂)/(T_o(T_n + T_o)) + K_v(q_ref − q₁) + h]/κ
  // For B = K_v = 0 this is p̂ = q₁ + (q₁ − q₂)T_n/T_o + ½T_n(T_n + T_o)h/M.
  bool set_period(double period_s) noexcept;

  [[nodiscard]] const AdmittanceConfig& config() const noexcept { return config_; }
  // At order 2: the number of steps in which the world's force wasn't weighted (impacts, releases, stick and slip).
  [[nodiscard]] std::uint64_t first_order_steps() const noexcept { return weights_.first_order_steps(); }

  void archive(fieldbus::StateArchive& state) noexcept {
    state(config_.mass_kg, config_.damping_Ns_per_m, config_.spring_N_per_m, config_.period_s, past_.q_k1, past_.q_k2,
          past_.v_k1, past_.period_k1_s, q_ref_, f_, p_hat_, kappa_, epoch_s_, steps_, weights_);
    prepare();
    // A moving object must start the next step, to the bit, at the place where the last step ended.
    if (solve_.timed()) solve_.g().set_time({time_s(), config_.period_s});
  }

 private:
  void prepare() noexcept;

  AdmittanceConfig config_;
  ProxySolver<N> solve_;
  ProxyHistory<N> past_;
  V q_ref_ = V::Zero();
  V f_ = V::Zero(), p_hat_ = V::Zero();
  double kappa_ = 0.0;
  double epoch_s_ = 0.0;  // the time label of q() is epoch_s_ + steps_ · T
  std::uint64_t steps_ = 0;
  // The following members are recomputed after changes of config_ or past_.period_k1_s.
  ProxyRule verlet_;
  double prepared_for_s_ = 0.0;  // period_k1_s for which verlet_ was computed
  double rate_Hz_ = 0.0;         // 1/T
  ForceWeights<N> weights_;      // used at order 2
};

extern template class AdmittanceProxy<1>;
extern template class AdmittanceProxy<2>;
extern template class AdmittanceProxy<3>;

}  // namespace proxarm::controller
