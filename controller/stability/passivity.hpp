// How much energy goes where while a hand leads the tool, and damping for when the loop gives the hand energy.
//
// Energy is observed at two ports. At the hand's port the measured force h meets the motion x of the tool, by the
// encoders. At the proxy's port the same force meets the proxy's motion, which is earlier than the tool's by the loop's
// delay. With Δ a difference over one
// period:
//   W_h(k) = W_h(k−1) + ½(h(k) + h(k−1))·Δx(k)                    what the hand gave to the device
//   W_p(k) = W_p(k−1) + T h(k)·v(k),   W_w(k) = W_w(k−1) + T f(k)·v(k)    what the proxy got from hand and world
// The equation of motion times T v(k) is the proxy's own balance, exact up to rounding. At order 1, where
// v = ∇q(k)/T, with (a − b)·a = ½(a² − b² + (a − b)²):
//   T (h + f)·v = Δ(½M v²) + T B v² + Δ(½K_v (q − q_ref)²) + ½M(∇v)² + ½K_v(∇q)²
// The last two terms are the step's own loss, so the integration never makes energy. At order 2 the same holds with
// ¼M(v² + (2v − v₁)²) for the kinetic energy and ¼M(v − 2v₁ + v₂)² for the loss. What the world makes (a moving object;
// curvature, on which (26) isn't neutral) is W_w > 0.
// W_p − W_h is the energy that delay, drives and arm put in between the two. For a force that accelerates M at ω and a
// motion that lags by L, the hand feels the damping
//   b(ω) = B cos ωL − M ω sin ωL,
// which is negative at every frequency where B < M ω tan ωL. The hand's own damping must outweigh it, or the loop
// oscillates.
//
// A reading of the force that is τ old belongs to the motion of τ ago: at 3 Hz and 50 ms they are 54° apart, enough to
// take a hand that is shaken for one that shakes. So the motion is delayed by τ, too, by the all-pass of Padé's
// approximation of order 2,
//   e^(−sτ) ≈ (s²τ² − 6sτ + 12)/(s²τ² + 6sτ + 12)      phase within 0.1° up to ωτ = 1.5, 2° up to 2.5; magnitude 1
// in the bilinear transform. Below, x is that motion.
//
// Oscillation is judged at the hand's port, above the band in which hands move by will (low_Hz). A Butterworth
// high-pass of order 4 filters force and motion alike, which keeps the phase between them; averages are over average_s:
//   P̂ = ⟨h̃·ẋ̃⟩,   b̂ = P̂/⟨ẋ̃²⟩        power that the hand gives, and the damping that it finds, there
//   E(k) = min(E(k−1) + T(P̂ + refill_W), tank_J)       the balance; E(0) = tank_J, never below −tank_J
// The device oscillates while the balance is negative and P̂ < −refill_W, and the band holds more than a share of ⟨ẋ²⟩.
// The tank is the energy that a touch may cost: a proxy that a wall stops moves energy from the hand's own band into
// this one for a moment. While the device oscillates, added damping grows,
//   Ḃ_a = −b̂/rise_s, up to max_damping,
// which ends where the hand's port is passive (b̂ ≥ 0): with any passive hand the loop is stable then. Else it decays:
// with release_s after the first oscillation, which may have been a blow and no more, and twice as slowly after each
// further one that begins before B_a has gone, up to longest_release_s: a grip that the loop can't stand oscillates
// again as soon as it is let. B_a is part of (26)'s B, implicit, so it changes neither position nor velocity by itself.
//
// The encoders don't see how gears twist. Where the hand's mass swings upon them, its force shakes the proxy, and that
// the gears in time with their own mode, the steel does far more than the motors: P̂ says nothing of it. So the device
// also oscillates where the force itself shakes as no hand can: ⟨h̃²⟩ > shake_N² at a frequency (⟨ẋ̃²⟩/⟨x̃²⟩)^½ above
// shake_Hz, the fastest at which people shake something. Damping then grows as it does for the largest −b̂.
//
// A blow on a wall, a hand that shakes for a moment and gears that ring look the same at first, but end by themselves.
// An oscillation lasts where it has gone on for lasting_s, pauses up to pause_s included (a wall stops it in every
// period), and hasn't died away meanwhile. Its amplitude is A with A² = 2⟨x̃²⟩, x̃ the motion behind the same high-pass:
// ⟨x̃²⟩ must be half of its largest at least. Where it falls to a sixteenth it is over, and what is left begins anew
// once it no longer falls to half in pause_s. Below felt_m it takes small_lasting_s. Then the loop isn't stable with
// this grip. Damping::what_lasts begins with it, and acts at once for remembered_s after each oscillation.
//
// Vectors in W. Neither allocates, locks nor throws; a session without it has none of it.
#pragma once

#include <array>
#include <cstdint>

#include "controller/stability/port_energies.hpp"
#include "models/base/state_archive.hpp"
#include "models/geometry/geometry.hpp"

namespace proxarm::controller {

struct PassivityConfig {
  // What hands do by will and with force behind it ends at about 2 Hz, the band of the apparent mass; a stiff grip
  // (3000 N/m) on 1 to 10 kg becomes unstable at 8 to 2.6 Hz.
  double low_Hz = 3.0;
  double average_s = 0.1;
  double share = 0.2;        // of the energy of all motion; a motion by will at 2 Hz has 0.04
  double tank_J = 1e-3;      // of a grip of 3000 N/m: an amplitude of 0.8 mm
  double refill_W = 0.5e-3;  // what 0.2 mm at 4 Hz get from a damping of −40 Ns/m: hardly felt, and let be
  double rise_s = 0.05;
  double most_felt_Ns_per_m = 200.0;  // of −b̂: B_a grows by no more than 4 Ns/m in a millisecond, which nobody feels
  double release_s = 0.5;
  double longest_release_s = 16.0;
  double gone_Ns_per_m = 0.1;  // of B_a; far below what any grip needs
  // A grip of K N/m is calm with about K L, L the loop's delay: 670 for 10,000 N/m and 67 ms.
  double max_damping_Ns_per_m = 1000.0;
  double shake_N = 20.0, shake_Hz = 7.0;
  // A blow swings for 0.1 to 0.3 s, gears ring for up to 1.4 s after it and fall meanwhile.
  double lasting_s = 0.5, small_lasting_s = 3.0, felt_m = 0.5e-3;
  double pause_s = 0.25;
  double remembered_s = 60.0;
  double force_age_s = 0.0;  // τ, of a reading when it is used; below half a period it counts as 0
};

enum class Damping : std::uint8_t {
  never,  // energies and oscillations are found, B_a stays 0
  what_lasts,
  at_once,
};

class PassivityObserver {
 public:
  PassivityObserver(const PassivityConfig& config, double period_s, Damping damping);

  // Before start(): what the filters hold is of the period before.
  void set_period(double period_s) noexcept;
  void start(const models::Vec3& tool_W) noexcept;
  // Called before a step, with this period's force and the tool's position. Returns B_a of the step, Ns/m.
  double observe_hand(const models::Vec3& h_W, const models::Vec3& tool_W) noexcept;
  // Called after the step, with the proxy's velocity, the world's force on it, its mass, and its whole damping.
  void observe_proxy(const models::Vec3& v_W, const models::Vec3& f_W, double mass_kg,
                     double damping_Ns_per_m) noexcept;

  [[nodiscard]] double added_damping_Ns_per_m() const noexcept { return added_; }
  [[nodiscard]] bool oscillates() const noexcept { return oscillates_; }
  [[nodiscard]] bool lasts() const noexcept;
  // ⟨ẋ̃²⟩^½ in m/s, and b̂ in Ns/m, which is 0 where nothing moves.
  [[nodiscard]] double oscillation_m_per_s() const noexcept;
  [[nodiscard]] double felt_damping_Ns_per_m() const noexcept;
  [[nodiscard]] const PortEnergies& energies_J() const noexcept { return energies_; }

  void archive(fieldbus::StateArchive& state) noexcept {
    for (HighPass* filter : {&force_, &motion_, &place_}) {
      for (Section& section : filter->sections) state(section.s1, section.s2);
    }
    state(delay_.s1, delay_.s2, release_s_, start_W_, square_, force_square_, spell_.lasted_s, spell_.pause_s,
          spell_.most, spell_.over, remembered_s_);
    state(h_k1_, h_, tool_k1_, power_, band_, all_, tank_, added_, oscillates_, energies_.hand, energies_.proxy,
          energies_.world, energies_.kinetic, energies_.damping, energies_.added);
  }

 private:
  struct Section {  // of order 2, transposed direct form II
    double gain = 1.0, a1 = 0.0, a2 = 0.0;
    models::Vec3 s1 = models::Vec3::Zero(), s2 = models::Vec3::Zero();
    models::Vec3 step(const models::Vec3& in) noexcept;
  };
  struct Delay {  // the all-pass, transposed direct form II: (a₂ + a₁z⁻¹ + z⁻²)/(1 + a₁z⁻¹ + a₂z⁻²)
    bool acts = false;
    double a1 = 0.0, a2 = 0.0;
    models::Vec3 s1 = models::Vec3::Zero(), s2 = models::Vec3::Zero();
    void design(double delay_s, double period_s) noexcept;
    models::Vec3 step(const models::Vec3& in) noexcept;
  };
  struct HighPass {
    std::array<Section, 2> sections;
    void design(double corner_Hz, double period_s) noexcept;
    models::Vec3 step(const models::Vec3& in) noexcept { return sections[1].step(sections[0].step(in)); }
    void reset() noexcept;
  };
  struct Spell {  // of oscillation, with pauses
    double lasted_s = 0.0;
    double pause_s = 0.0;  // since the last oscillation
    double most = 0.0;     // the largest ⟨x̃²⟩
    bool over = false;     // it dies away: `most` is what it was pause_s ago
  };
  [[nodiscard]] bool shakes() const noexcept;
  void follow_spell() noexcept;
  void follow_damping(bool begins) noexcept;

  PassivityConfig config_;
  double period_s_ = 0.0;
  Damping damping_;
  double average_ = 0.0;    // share of a new value in an average
  double release_s_ = 0.0;  // with which B_a decays now
  Delay delay_;             // of the motion, to the force's age
  HighPass force_, motion_, place_;
  models::Vec3 start_W_ = models::Vec3::Zero();  // where the tool was when rendering began
  models::Vec3 h_ = models::Vec3::Zero(), h_k1_ = models::Vec3::Zero(), tool_k1_ = models::Vec3::Zero();
  double power_ = 0.0, band_ = 0.0, all_ = 0.0;  // ⟨h̃·ẋ̃⟩, ⟨ẋ̃²⟩, ⟨ẋ²⟩
  double square_ = 0.0, force_square_ = 0.0;     // ⟨x̃²⟩, ⟨h̃²⟩
  double tank_ = 0.0;
  double added_ = 0.0;  // B_a
  Spell spell_;
  double remembered_s_ = 0.0;  // for so long an oscillation is damped at once
  bool oscillates_ = false;
  PortEnergies energies_;
};

}  // namespace proxarm::controller
