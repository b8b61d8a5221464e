// A mass M that the measured force pushes through a virtual world: the paper's admittance-type rendering, eq. (26).
//
// Kikuuwe and Fujimoto, "Incorporating Geometric Algorithms in Impedance- and Admittance-Type Haptic Rendering",
// Proc. World Haptics 2007. The force h that the hand puts on the sensor goes in, the position q that the drives must
// follow comes out. The world is any 𝒢 (models/geometry/geometric_algorithm.hpp); whoever writes one thinks about
// geometry alone.
//
//   p̂(k) = 2 q(k−1) − q(k−2) + T² h(k)/M     (26a)
//   q(k) = 𝒢(M/T², p̂(k), q(k−1))             (26b)
//   f(k) = (M/T²)(q(k) − p̂(k))               (25a)   the world's force on the proxy
//
// Beyond the paper, all of it through the same 𝒢:
// - Damping B and a spring K_v to q_ref, implicit, so none is too stiff:
//     M∇²q/T² + B∇q/T + K_v(q − q_ref) = h + ℳ(q, ∇q/T)   is (26) with
//     κ = M/T² + B/T + K_v,   p̂ = [M(2q₁ − q₂)/T² + B q₁/T + K_v q_ref + h]/κ,   q₁ = q(k−1), q₂ = q(k−2).
// - Parameters change without a bump: M, B, K_v and q_ref at once (they don't touch position or velocity); a new T
//   takes one step on the uneven grid, see set_period().
// - Order 2: bdf2.hpp has the equations.
//
// Time labels. At order 1, q(k) made of h(k) = h(t_k) is the state at t_{k+1} (Störmer–Verlet, shifted by one sample),
// which is when the next SYNC makes it effective. The history that start() sets is exact for it: free flight under a
// constant force lands on the parabola to rounding. At order 2, q(k) is the state at t_k; with `matched_labels` h(k) is
// replaced by 2h(k) − h(k−1), so that it is t_{k+1} as well, which costs noise: white
// noise of 1 N at 1 kg becomes 1.00 m/s² at order 1, 0.71 at order 2 and 1.36 with matched labels.
//
// All vectors in one frame, metres, newtons, seconds. n = 1, 2 or 3. One caller at a time; step() and the setters are
// for the cycle: they neither allocate, lock, throw nor print.
#pragma once

#include <cstdint>

#include "controller/proxies/bdf2.hpp"
#include "controller/proxies/proxy_step.hpp"
#include "models/base/state_archive.hpp"
#include "models/geometry/geometric_algorithm.hpp"
#include "models/geometry/geometry.hpp"

namespace proxarm::controller {

template <int N>
class AdmittanceProxy {
 public:
  using V = models::Vec<N>;

  // Validates `config`. `g` is used by this proxy alone and must outlive it.
  AdmittanceProxy(const AdmittanceConfig& config, models::GeometricAlgorithm<N>& g);

  // Sets the history so that the next step continues the motion q₀ + v₀t + ½a₀t². Any value that isn't finite: false,
  // and nothing changes.
  bool start(const ProxyStart<N>& start) noexcept;

  // The state of `other`, its parameters included, with this proxy's own 𝒢. Objects that move are told its time.
  void follow(const AdmittanceProxy& other) noexcept;

  // One period under the measured force h(k). On a fault nothing has changed, and the step may be repeated.
  [[nodiscard]] ProxyFault step(const V& h) noexcept;

  // Of the last step. Before the first: the start position, zero force, p̂ = q.
  [[nodiscard]] const V& q() const noexcept { return past_.q_k1; }
  [[nodiscard]] const V& f() const noexcept { return f_; }
  [[nodiscard]] const V& p_hat() const noexcept { return p_hat_; }
  [[nodiscard]] double kappa_N_per_m() const noexcept { return kappa_; }
  // Order 1: mean velocity over the last step. Order 2: velocity at the end of it.
  [[nodiscard]] const V& velocity() const noexcept { return past_.v_k1; }
  [[nodiscard]] double time_s() const noexcept { return epoch_s_ + static_cast<double>(steps_) * config_.period_s; }

  // From the next step on; false, and nothing changes, where AdmittanceConfig's ranges don't hold.
  bool set_mass(double mass_kg) noexcept;
  bool set_damping(double damping_Ns_per_m) noexcept;
  bool set_spring(double spring_N_per_m) noexcept;
  bool set_reference(const V& q_ref) noexcept;
  // One step spans two unequal intervals T_o, T_n; there ∇²q/T² reads 2[(q−q₁)/T_n − (q₁−q₂)/T_o]/(T_n + T_o), so
  //   κ = 2M/(T_n(T_n + T_o)) + B/T_n + K_v,   p̂ = q₁ + [2M(q₁ − q₂)/(T_o(T_n + T_o)) + K_v(q_ref − q₁) + h]/κ,
  // which for B = K_v = 0 is p̂ = q₁ + (q₁ − q₂)T_n/T_o + ½T_n(T_n + T_o)h/M.
  bool set_period(double period_s) noexcept;

  [[nodiscard]] const AdmittanceConfig& config() const noexcept { return config_; }
  // Order 2: how many steps didn't look back at q(k−2) (impacts, releases, stick and slip, restarts).
  [[nodiscard]] std::uint64_t first_order_steps() const noexcept { return bdf2_.first_order_steps(); }

  void archive(fieldbus::StateArchive& state) noexcept {
    state(config_.mass_kg, config_.damping_Ns_per_m, config_.spring_N_per_m, config_.period_s, past_.q_k1, past_.q_k2,
          past_.v_k1, past_.v_k2, past_.h_k1, past_.has_h_k1, past_.period_k1_s, q_ref_, f_, p_hat_, kappa_, epoch_s_,
          steps_, bdf2_);
    prepare();
    // Where a moving object comes from is where the step before took it, to the bit.
    if (solve_.timed()) solve_.g().set_time({time_s(), config_.period_s});
  }

 private:
  void prepare() noexcept;
  ProxyFault verlet(const V& h, ProxyTrial<N>& out) noexcept;

  AdmittanceConfig config_;
  ProxySolver<N> solve_;
  ProxyHistory<N> past_;
  V q_ref_ = V::Zero();
  V f_ = V::Zero(), p_hat_ = V::Zero();
  double kappa_ = 0.0;
  double epoch_s_ = 0.0;  // time label of q() is epoch + steps · T
  std::uint64_t steps_ = 0;
  // Made of config_ and past_.period_k1_s when one of them has changed.
  ProxyRule verlet_;
  bool plain_ = true;            // no B, no K_v, equal intervals: (26a) as it stands
  double prepared_for_s_ = 0.0;  // the period_k1_s of verlet_
  double rate_Hz_ = 0.0;         // 1/T
  Bdf2<N> bdf2_;                 // order 2
};

extern template class AdmittanceProxy<1>;
extern template class AdmittanceProxy<2>;
extern template class AdmittanceProxy<3>;

}  // namespace proxarm::controller
