// Observes the energy flow while a hand leads the tool, and adds damping when the loop gives energy to the hand.
//
// Energy is observed at two ports. At the hand's port, the measured force h acts along the tool's motion x, by the
// encoders. At the proxy's port the same force acts along the proxy's motion, which precedes the tool's by the loop's
// delay. With Δ a difference over one period:
//   W_h(k) = W_h(k−1) + ½(h(k) + h(k−1))·Δx(k)                    from the hand to the device
//   W_p(k) = W_p(k−1) + T h(k)·v(k),   W_w(k) = W_w(k−1) + T f(k)·v(k)    to the proxy, from hand and world
// The equation of motion times T v(k) is the proxy's energy balance, exact up to rounding. At order 1, where v =
// ∇q(k)/T, with (a − b)·a = ½(a² − b² + (a − b)²):
//   T (h + f)·v = Δ(½M v²) + T B v² + Δ(½K_v (q − q_ref)²) + ½M(∇v)² + ½K_v(∇q)²
// The last two terms are the step's own loss, so the integration never generates energy; at order 2 the same holds with
// its weighted h, B and K_v. W_w > 0 if the world generates energy: moving objects, or curved surfaces, on which (26)
// isn't neutral. W_p − W_h is the energy that delay, drives and arm add. For a force that accelerates M at the
// frequency ω, and a motion that lags by L, the hand feels the damping
//   b(ω) = B cos ωL − M ω sin ωL,
// which is negative at every frequency where B < M ω tan ωL. The hand's own damping must outweigh it, or the loop
// oscillates.
//
// A force reading of age τ belongs to the motion τ ago. At 3 Hz and 50 ms the two are 54° apart, which would confuse
// who shakes whom. So the motion is delayed by τ, too (delay.hpp); below, x is the delayed motion.
//
// Oscillation is judged at the hand's port, above the band of deliberate hand motion (low_Hz), with one filter for
// force and motion (band.hpp). Averages are over average_s, and ẋ is the speed after the filter's low-pass:
//   P̂ = ⟨h̃·ẋ̃⟩,   b̂ = P̂/⟨ẋ̃²⟩        power that the hand gives, and damping that it feels, in the band
//   E(k) = min(E(k−1) + T(P̂ + refill_W), tank_J)       the balance; E(0) = tank_J, E ≥ −tank_J
// The device oscillates while E is negative, P̂ < −refill_W, and the band holds more than a share of ⟨ẋ²⟩. The tank is
// the energy that a touch may cost: when a wall stops the proxy, energy moves from the hand's own band into this one
// for a moment. While the device oscillates, the added damping grows,
//   Ḃ_a = −b̂/rise_s, up to max_damping,
// until the hand's port is passive (b̂ ≥ 0); then the loop is stable with any passive hand. Otherwise B_a decays with a
// time constant of release_s. This doubles, up to longest_release_s, with each oscillation that begins before B_a has
// gone: the loop is then unstable with this grip, and not merely hit. B_a is part of (26)'s implicit B, so it changes
// neither position nor velocity by itself.
//
// For a tool that turns, position and rotation are judged together. τ_h is the hand's torque about the rendered point,
// ω the tool's angular velocity. Rotations are weighted with ρ² = J/M in m²/rad², the squared radius of gyration of
// what is felt, so that M(ẋ² + ρ²ω²) is twice its energy.
//   W_h += ½(τ_h(k) + τ_h(k−1))·Δφ(k),   W_p += T τ_h·ω,   W_w += T τ_w·ω
//   P̂ = ⟨h̃·ẋ̃ + τ̃·ω̃⟩,   and ⟨ẋ̃² + ρ²ω̃²⟩, ⟨x̃² + ρ²φ̃²⟩, ⟨h̃² + τ̃²/g²⟩ in place of ⟨ẋ̃²⟩, ⟨x̃²⟩, ⟨h̃²⟩
// Position and rotation exchange energy, so neither alone shows who gives. A torque counts as two forces on the ends of
// a grip of breadth g. The added damping acts on the position as B_a and on the rotation as ρ²B_a, so both decay at the
// rate B_a/M. The motion is observed by the links of the arm's model (link_motion.hpp) and by the motors. The tool
// oscillates if either view says so, and b̂ is the smaller one: near the arm's first mode the motors' phase is wrong,
// and the links' phase if the gears' true stiffness differs from the model's. Energies, ⟨x̃²⟩ and frequency are the
// links'.
//
// For a tool that doesn't turn, the motion comes from the encoders, which don't see the gears' twist. If the hand's
// mass oscillates on the gears, the links move far more than the motors, and P̂ doesn't show it. So the device also
// counts as oscillating if the force shakes as no hand can: ⟨h̃²⟩ > shake_N² at a frequency (⟨ẋ̃²⟩/⟨x̃²⟩)^½ above
// shake_Hz, the fastest at which people shake something. Damping then grows as for the largest −b̂.
//
// A blow on a wall, a hand that shakes for a moment, and ringing gears look the same at first, but end by themselves.
// Whether an oscillation lasts is judged by its amplitude over time (spell.hpp). If it lasts, the loop is unstable with
// this grip. Damping::what_lasts acts from then on, and at once if the device oscillates again within remembered_s.
//
// Vectors in W. Never allocates, locks or throws. A session without passivity doesn't have this object.
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
  double share = 0.2;        // of the energy of all motion; a deliberate motion at 2 Hz has 0.04
  double tank_J = 1e-3;      // for a grip of 3000 N/m: an amplitude of 0.8 mm
  double refill_W = 0.5e-3;  // the power of a damping of −40 Ns/m at 0.2 mm and 4 Hz: hardly felt, and tolerated
  double rise_s = 0.05;
  double most_felt_Ns_per_m = 200.0;  // bound of −b̂: B_a grows by at most 4 Ns/m in a millisecond, which isn't felt
  double release_s = 0.5;
  double longest_release_s = 16.0;
  double gone_Ns_per_m = 0.1;  // below this, B_a counts as gone; far less than any grip needs
  // A grip of K N/m needs a damping of about K L, L being the loop's delay: 670 Ns/m for 10,000 N/m and 67 ms.
  double max_damping_Ns_per_m = 1000.0;
  double shake_N = 20.0, shake_Hz = 7.0;
  // g: the distance between palm and fingertips, or between a handle's ends. 20 N there make 2 Nm. Shaking a hand of
  // 0.003 kg m² by 0.15 rad at 7 Hz takes 0.9 Nm.
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

// A step of a proxy that turns: twists in (m/s, rad/s), wrenches in (N, Nm) about the rendered point.
struct TurningPort {
  models::Twist velocity_W = models::Twist::Zero(), world_W = models::Twist::Zero();
  double kinetic_J = 0.0;
  double damping_Ns_per_m = 0.0, turning_damping_Nms_per_rad = 0.0;  // B_a and ρ²B_a included
};

class PassivityObserver {
 public:
  PassivityObserver(const PassivityConfig& config, double period_s, Damping damping);

  // Precondition: called before start(), since the filters' state belongs to the old period.
  void set_period(double period_s) noexcept;
  void start(const models::Vec3& tool_W) noexcept;
  // Returns the step's B_a, Ns/m. Precondition: called before each step, with this period's force and the tool's
  // position.
  double observe_hand(const models::Vec3& h_W, const models::Vec3& tool_W) noexcept;
  // The same for a tool that turns, with ρ² in m²/rad². Precondition: a session calls only one of the two.
  double observe_hand(const models::Wrench& h_W, const ToolMove& move, double gyration_m2) noexcept;
  // Precondition: called after each step, with the proxy's velocity, the world's force on it, its mass and total
  // damping.
  void observe_proxy(const models::Vec3& v_W, const models::Vec3& f_W, double mass_kg,
                     double damping_Ns_per_m) noexcept;
  void observe_proxy(const TurningPort& port) noexcept;

  [[nodiscard]] double added_damping_Ns_per_m() const noexcept { return added_; }
  [[nodiscard]] bool oscillates() const noexcept { return oscillates_; }
  [[nodiscard]] bool lasts() const noexcept { return spell_.lasts(); }
  // ⟨ẋ̃²⟩^½ in m/s, and b̂ in Ns/m, which is 0 if nothing moves.
  [[nodiscard]] double oscillation_m_per_s() const noexcept;
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
  struct View {  // the motion as the links or the motors show it
    Band motion, place;
    Band turning, angle;  // of a tool that turns, as is moved_W
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
  View seen_, motors_;                           // the view that counts; for a tool that turns also the motors'
  models::Vec3 start_W_ = models::Vec3::Zero();  // where the tool was when rendering began
  models::Vec3 h_ = models::Vec3::Zero(), h_k1_ = models::Vec3::Zero(), tool_k1_ = models::Vec3::Zero();
  models::Vec3 torque_W_ = models::Vec3::Zero();  // τ_h
  double gyration_m2_ = 0.0;                      // ρ²
  double force_square_ = 0.0;                     // ⟨h̃²⟩
  double added_ = 0.0;                            // B_a
  Spell spell_;
  double remembered_s_ = 0.0;  // how long the next oscillation is still damped at once
  bool oscillates_ = false;
  PortEnergies energies_;
};

}  // namespace proxarm::controller
