// Observes the energy that a hand exchanges with the device while it leads the tool, and adds damping when the loop
// gives energy to the hand.
//
// Energy is observed at two ports. At the hand's port, the measured force h acts along the tool's motion x, which the
// encoders measure. At the proxy's port, h acts along the proxy's motion, which precedes the tool's motion by the
// loop's delay. With Δ a difference over one period:
//   W_h(k) = W_h(k−1) + ½(h(k) + h(k−1))·Δx(k)                    from the hand to the device
//   W_p(k) = W_p(k−1) + T h(k)·v(k),   W_w(k) = W_w(k−1) + T f(k)·v(k)    to the proxy, from hand and world
// The equation of motion times T v(k) is the proxy's energy balance, exact up to rounding. At order 1, with v = ∇q(k)/T
// and (a − b)·a = ½(a² − b² + (a − b)²), the balance is
//   T (h + f)·v = Δ(½M v²) + T B v² + Δ(½K_v (q − q_ref)²) + ½M(∇v)² + ½K_v(∇q)²
// The last two terms are the step's own loss, so the integration never generates energy. At order 2 the same holds with
// order 2's weighted h, B and K_v. W_w > 0 if the world generates energy, as moving objects do, and curved surfaces, on
// which (26) doesn't conserve energy. W_p − W_h is the energy that delay, drives and arm add. If a force accelerates M
// at the frequency ω, and the motion lags by L, the hand feels the damping
//   b(ω) = B cos ωL − M ω sin ωL,
// which is negative at every frequency where B < M ω tan ωL. The hand's own damping must outweigh a negative b(ω), or
// the loop oscillates.
//
// A force reading of age τ belongs to the motion τ ago. At 3 Hz and τ = 50 ms, force and motion would be 54° apart, and
// P̂ below could have the wrong sign. So the motion is delayed by τ, too (delay.hpp). Below, x is the delayed motion.
//
// Oscillation is judged at the hand's port, above the band of deliberate hand motion (low_Hz). A tilde marks a force or
// motion after the band-pass, which is the same for both (band.hpp). ⟨ ⟩ is an average over average_s. ẋ without a
// tilde is the speed after the low-pass alone:
//   P̂ = ⟨h̃·ẋ̃⟩,   b̂ = P̂/⟨ẋ̃²⟩        power that the hand gives, and damping that it feels, in the band
//   E(k) = min(E(k−1) + T(P̂ + refill_W), tank_J)       the balance; E(0) = tank_J, E ≥ −tank_J
// The device oscillates while E is negative, P̂ < −refill_W, and ⟨ẋ̃²⟩ is more than `share` of ⟨ẋ²⟩. tank_J is the
// energy that a touch may cost: when a wall stops the proxy, energy moves for a moment from the band of deliberate
// motion into the band-pass's band. While the device oscillates, the added damping B_a grows,
//   Ḃ_a = −b̂/rise_s, up to max_damping,
// until the hand's port is passive (b̂ ≥ 0). The loop is then stable with any passive hand. While the device doesn't
// oscillate, B_a decays with a time constant of release_s. The time constant doubles, up to longest_release_s, with
// each oscillation that begins before B_a has gone: an oscillation that comes back shows an unstable loop instead of a
// blow. B_a is part of (26)'s implicit B, so adding it changes neither position nor velocity by itself.
//
// For a tool that turns, position and rotation are judged together, since they exchange energy, and neither alone shows
// whether the hand gives or takes. τ_h is the hand's torque about the rendered point, φ the tool's rotation and ω its
// angular velocity. Rotations are weighted with ρ² = J/M in m²/rad², the squared radius of gyration of the felt mass
// and inertia, so that M(ẋ² + ρ²ω²) is twice the kinetic energy.
//   W_h += ½(τ_h(k) + τ_h(k−1))·Δφ(k),   W_p += T τ_h·ω,   W_w += T τ_w·ω
//   P̂ = ⟨h̃·ẋ̃ + τ̃·ω̃⟩,   and ⟨ẋ̃² + ρ²ω̃²⟩, ⟨x̃² + ρ²φ̃²⟩, ⟨h̃² + τ̃²/g²⟩ in place of ⟨ẋ̃²⟩, ⟨x̃²⟩, ⟨h̃²⟩
// A torque counts as two forces on the ends of a grip of breadth g. The added damping is B_a for the position and ρ²B_a
// for the rotation, so both decay at the rate B_a/M. The motion is observed twice: for the links by the arm's model
// (link_motion.hpp), and for the motors by the encoders. The tool oscillates if the links' or the motors' motion shows
// it, and b̂ is the smaller value. Both are needed: near the arm's first mode the motors' phase is wrong, and the
// links' phase is wrong if the gears' true stiffness differs from the model's. Energies, ⟨x̃²⟩ and frequency come from
// the links.
//
// For a tool that doesn't turn, the motion comes from the encoders, which don't see the gears' twist. If the hand's
// mass oscillates on the gears, the links move far more than the motors, and P̂ doesn't show it. So the device also
// counts as oscillating if the force shakes as no hand can: ⟨h̃²⟩ > shake_N² at a frequency (⟨ẋ̃²⟩/⟨x̃²⟩)^½ above
// shake_Hz, the fastest at which people shake something. B_a then grows as for the largest −b̂ (most_felt_Ns_per_m).
//
// A blow on a wall, a hand that shakes for a moment, and ringing gears look like an unstable loop at first, but end by
// themselves. spell.hpp judges by the amplitude over time whether an oscillation lasts. If the oscillation lasts, the
// loop is unstable with this grip. Damping::what_lasts adds damping from then on, and at once if the device oscillates
// again within remembered_s.
//
// Vectors are in W. Never allocates, locks or throws. A session without passivity doesn't have this object.
#pragma once

#include <array>
#include <cstdint>

#include "controller/stability/band.hpp"
#include "controller/stability/delay.hpp"
#include "controller/stability/port_energies.hpp"
#include "controller/stability/spell.hpp"
#include "controller/stability/tool_move.hpp"
#include "models/base/state_archive.hpp"
#include "models/geometry/geometry.hpp"
#include "models/geometry/tool_pose.hpp"

namespace proxarm::controller {

struct PassivityConfig {
  // Deliberate, forceful hand motion ends at about 2 Hz, the band of the apparent mass. A stiff grip (3000 N/m) on 1 to
  // 10 kg becomes unstable at 8 to 2.6 Hz.
  BandLimits band{.low_Hz = 3.0};
  double average_s = 0.1;
  double share = 0.2;        // least ⟨ẋ̃²⟩/⟨ẋ²⟩ of an oscillation; a deliberate motion at 2 Hz has 0.04
  double tank_J = 1e-3;      // the energy of an amplitude of 0.8 mm in a grip of 3000 N/m
  double refill_W = 0.5e-3;  // a power that is hardly felt, so tolerated: a damping of −40 Ns/m at 0.2 mm and 4 Hz
  double rise_s = 0.05;
  double most_felt_Ns_per_m = 200.0;  // bound of −b̂: B_a grows by at most 4 Ns/m in a millisecond, which isn't felt
  double release_s = 0.5;
  double longest_release_s = 16.0;
  double gone_Ns_per_m = 0.1;  // below this, B_a counts as gone; far less than any grip needs
  // A grip of K N/m needs a damping of about K L, with the loop's delay L: 670 Ns/m for 10,000 N/m and 67 ms.
  double max_damping_Ns_per_m = 1000.0;
  double shake_N = 20.0, shake_Hz = 7.0;
  // g: the distance between palm and fingertips, or between a handle's ends. Two forces of 20 N at this distance make 2
  // Nm. To shake a hand of 0.003 kg m² by 0.15 rad at 7 Hz takes 0.9 Nm.
  double grip_m = 0.1;
  SpellConfig spell{};
  double remembered_s = 60.0;
  double force_age_s = 0.0;  // τ, the age of a reading when it is used; below half a period it counts as 0
};

enum class Damping : std::uint8_t {
  never,  // B_a stays 0; energies and oscillations are still observed
  what_lasts,
  at_once,
};

// A step of a proxy that turns. Twists are in (m/s, rad/s), wrenches in (N, Nm) about the rendered point.
struct TurningPort {
  models::Twist velocity_W = models::Twist::Zero(), world_W = models::Twist::Zero();
  double kinetic_J = 0.0;
  double damping_Ns_per_m = 0.0, turning_damping_Nms_per_rad = 0.0;  // B_a and ρ²B_a included
};

class PassivityObserver {
 public:
  PassivityObserver(const PassivityConfig& config, double period_s, Damping damping);

  // Sets T. Precondition: called before start(), since the filters' state belongs to the old period.
  void set_period(double period_s) noexcept;
  void start(const models::Vec3& tool_W) noexcept;
  // Observes the hand's port in this period: the hand's force and the tool's position. Returns B_a for the next step,
  // Ns/m. Precondition: called once before each step.
  double observe_hand(const models::Vec3& h_W, const models::Vec3& tool_W) noexcept;
  // Observes the hand's port of a tool that turns, with ρ² in m²/rad². Precondition: a session calls only one of the
  // two observe_hand() functions.
  double observe_hand(const models::Wrench& h_W, const ToolMove& move, double gyration_m2) noexcept;
  // Observes the proxy's port: the proxy's velocity, the world's force on the proxy, the proxy's mass and total
  // damping. Precondition: called once after each step.
  void observe_proxy(const models::Vec3& v_W, const models::Vec3& f_W, double mass_kg,
                     double damping_Ns_per_m) noexcept;
  void observe_proxy(const TurningPort& port) noexcept;

  [[nodiscard]] double added_damping_Ns_per_m() const noexcept { return added_; }
  [[nodiscard]] bool oscillates() const noexcept { return oscillates_; }
  [[nodiscard]] bool lasts() const noexcept { return spell_.lasts(); }
  // ⟨ẋ̃²⟩^½, m/s.
  [[nodiscard]] double oscillation_m_per_s() const noexcept;
  // b̂, Ns/m; 0 if nothing moves.
  [[nodiscard]] double felt_damping_Ns_per_m() const noexcept;
  [[nodiscard]] const PortEnergies& energies_J() const noexcept { return energies_; }
  // For a tool that turns: sums of its displacements, m, and rotations, rad, since rendering began.
  [[nodiscard]] const models::Twist& moved_W() const noexcept { return seen_.moved_W; }

  void archive(fieldbus::StateArchive& state) noexcept {
    for (Band* band : {&force_, &torque_}) band->archive(state);
    for (View* view : {&seen_, &motors_}) {
      for (Band* band : {&view->motion, &view->place, &view->turning, &view->angle}) band->archive(state);
      state(view->moved_W, view->power, view->band, view->all, view->square, view->tank);
    }
    spell_.archive(state);
    state(delay_.s1, delay_.s2, release_s_, start_W_, force_square_, remembered_s_, torque_W_, gyration_m2_);
    state(h_k1_, h_, tool_k1_, added_, oscillates_, energies_.hand, energies_.proxy, energies_.world, energies_.kinetic,
          energies_.damping, energies_.added);
  }

 private:
  // A motion, seen by the links or by the motors, and its averages.
  struct View {
    Band motion, place;
    Band turning, angle;  // turning, angle and moved_W: for a tool that turns
    models::Twist moved_W = models::Twist::Zero();
    double power = 0.0, band = 0.0, all = 0.0;  // ⟨h̃·ẋ̃⟩, ⟨ẋ̃²⟩, ⟨ẋ²⟩
    double square = 0.0;                        // ⟨x̃²⟩
    double tank = 0.0;
  };
  struct Moment {
    double power, band, all, square;
  };
  [[nodiscard]] Moment look(View& view, const models::Twist& move_W, const models::Vec3& force,
                            const models::Vec3& torque) const noexcept;
  void take(View& view, const Moment& now) const noexcept;
  [[nodiscard]] bool gives(const View& view) const noexcept;
  [[nodiscard]] bool shakes() const noexcept;
  double judge(double force_square) noexcept;
  void follow_spell() noexcept;
  void follow_damping(bool begins) noexcept;

  PassivityConfig config_;
  double period_s_ = 0.0;
  Damping damping_;
  double average_ = 0.0;       // weight of a new value in an average
  double release_s_ = 0.0;     // present time constant of B_a's decay
  Delay<models::Vec3> delay_;  // delays the motion by the force's age
  Band force_, torque_;
  // seen_: by the links for a tool that turns, else by the encoders. motors_: by the motors, only for a tool that
  // turns.
  View seen_, motors_;
  models::Vec3 start_W_ = models::Vec3::Zero();  // where the tool was when rendering began
  models::Vec3 h_ = models::Vec3::Zero(), h_k1_ = models::Vec3::Zero(), tool_k1_ = models::Vec3::Zero();
  models::Vec3 torque_W_ = models::Vec3::Zero();  // τ_h
  double gyration_m2_ = 0.0;                      // ρ²
  double force_square_ = 0.0;                     // ⟨h̃²⟩
  double added_ = 0.0;                            // B_a
  Spell spell_;
  double remembered_s_ = 0.0;  // time for which another oscillation is damped at once
  bool oscillates_ = false;
  PortEnergies energies_;
};

}  // namespace proxarm::controller
