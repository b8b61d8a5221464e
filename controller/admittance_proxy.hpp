// A mass M that the measured force pushes through a virtual world: the paper's admittance-type rendering, eq. (26).
//
// Kikuuwe and Fujimoto, "Incorporating Geometric Algorithms in Impedance- and Admittance-Type Haptic Rendering",
// Proc. World Haptics 2007. The force h that the hand puts on the sensor goes in, the position q that the drives must
// follow comes out. The world is any 𝒢 (models/geometric_algorithm.hpp); whoever writes one thinks about geometry
// alone.
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
// takes
//   one step on the uneven grid, see set_period().
// - Order 2 (BDF2): admittance_proxy.cpp has the equations.
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

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "fieldbus/state_archive.hpp"
#include "models/geometric_algorithm.hpp"
#include "models/geometry.hpp"

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

template <int N>
class AdmittanceProxy {
 public:
  using V = models::Vec<N>;

  // Validates `config`. `g` is used by this proxy alone and must outlive it.
  AdmittanceProxy(const AdmittanceConfig& config, models::GeometricAlgorithm<N>& g);

  // Sets the history so that the next step continues the motion q₀ + v₀t + ½a₀t². Any value that isn't finite: false,
  // and nothing changes.
  bool start(const ProxyStart<N>& start) noexcept;

  // One period under the measured force h(k). On a fault nothing has changed, and the step may be repeated.
  [[nodiscard]] ProxyFault step(const V& h) noexcept;

  // Of the last step. Before the first: the start position, zero force, p̂ = q.
  [[nodiscard]] const V& q() const noexcept { return q_k1_; }
  [[nodiscard]] const V& f() const noexcept { return f_; }
  [[nodiscard]] const V& p_hat() const noexcept { return p_hat_; }
  [[nodiscard]] double kappa_N_per_m() const noexcept { return kappa_; }
  // Order 1: mean velocity over the last step. Order 2: velocity at the end of it.
  [[nodiscard]] const V& velocity() const noexcept { return v_k1_; }
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
  [[nodiscard]] std::uint64_t first_order_steps() const noexcept { return first_order_steps_; }

  void archive(fieldbus::StateArchive& state) noexcept {
    state(config_.mass_kg, config_.damping_Ns_per_m, config_.spring_N_per_m, config_.period_s, q_k1_, q_k2_, v_k1_,
          v_k2_, h_k1_, has_h_k1_, period_k1_s_, q_ref_, f_, p_hat_, kappa_, epoch_s_, steps_, contacts_,
          restart_steps_left_, after_impact_, first_order_steps_);
    prepare();
    // Where a moving object comes from is where the step before took it, to the bit.
    if (timed_) g_->set_time({time_s(), config_.period_s});
  }

 private:
  static constexpr std::size_t max_contacts = 8;

  // Which objects press, where, and whether they slip; what order 2 must notice a change of.
  struct ContactSet {
    struct Key {
      std::int32_t object, feature;
      bool slips;
    };
    std::array<Key, max_contacts> keys;  // the first `count`
    std::size_t count = 0;
    bool overflow = false;  // more than fit: never equal to anything
    bool known = true;
    bool held = false;  // q = q(k−1) bit for bit although p̂ isn't: a 𝒢 that reports no contacts may stick all the same

    void archive(fieldbus::StateArchive& state) noexcept {
      state(count, overflow, known, held);
      count = std::min(count, max_contacts);
      for (Key& key : std::span(keys).first(count)) state(key.object, key.feature, key.slips);
    }
  };

  // What M, B, K_v and T make of
  //   p̂ = q₁ + of_move (q₁ − q₂) + of_v1 v₁ + of_v2 v₂ + of_reference (q_ref − q₁) + h/κ
  struct Rule {
    double kappa = 0.0, compliance = 0.0;  // κ, 1/κ
    double of_move = 0.0, of_v1 = 0.0, of_v2 = 0.0, of_reference = 0.0;
  };

  struct Trial {
    double kappa = 0.0;
    V p_hat, q, v, f;
    bool held = false;
  };

  static void set_contacts(ContactSet& set, std::span<const models::Contact<N>> contacts, bool held) noexcept;
  static bool same(const ContactSet& a, const ContactSet& b) noexcept;
  static bool gained(const ContactSet& before, const ContactSet& now) noexcept;
  static bool same_sides(const ContactSet& set, const std::array<V, max_contacts>& normals,
                         std::span<const models::Contact<N>> contacts) noexcept;
  void go_back(const ProxyStart<N>& start) noexcept;

  void prepare() noexcept;
  ProxyFault verlet(const V& h, Trial& out) noexcept;
  ProxyFault euler(const V& h, Trial& out) noexcept;
  ProxyFault parabola(const V& h, Trial& out) noexcept;
  ProxyFault restart(const V& h, Trial& out, ContactSet& now, bool changed) noexcept;
  ProxyFault bdf2(const V& h, Trial& out, ContactSet& now, bool& contacts_changed) noexcept;
  bool in_reach(const Trial& out) noexcept;
  ProxyFault second_order(const V& h, Trial& out) noexcept;
  ProxyFault solve(Trial& out, const V& q_previous, double law_period_s) noexcept;

  AdmittanceConfig config_;
  models::GeometricAlgorithm<N>* g_;
  V q_k1_ = V::Zero(), q_k2_ = V::Zero();  // q(k−1), q(k−2)
  V v_k1_ = V::Zero(), v_k2_ = V::Zero();  // their velocities
  V h_k1_ = V::Zero();
  bool has_h_k1_ = false;
  double period_k1_s_ = 0.0;  // time between q(k−2) and q(k−1)
  V q_ref_ = V::Zero();
  V f_ = V::Zero(), p_hat_ = V::Zero();
  double kappa_ = 0.0;
  double epoch_s_ = 0.0;  // time label of q() is epoch + steps · T
  std::uint64_t steps_ = 0;
  ContactSet contacts_;
  // Made of config_ and period_k1_s_ when one of them has changed.
  Rule verlet_, euler_, parabola_, bdf2_;
  bool plain_ = true;            // no B, no K_v, equal intervals: (26a) as it stands
  double prepared_for_s_ = 0.0;  // the period_k1_s_ of verlet_
  double rate_Hz_ = 0.0;         // 1/T
  bool timed_ = true;            // 𝒢 wants set_time()
  int restart_steps_left_ = 0;   // order 2: before it may look back again
  bool after_impact_ = false;    // those by Euler
  std::uint64_t first_order_steps_ = 0;
};

extern template class AdmittanceProxy<1>;
extern template class AdmittanceProxy<2>;
extern template class AdmittanceProxy<3>;

}  // namespace proxarm::controller
