// Judges whether the loop of proxy (26), arm and hand is stable while a hand holds the tool. Computes the eigenvalues
// of the closed loop, and the smallest stable mass.
//
// In free motion the loop is linear. With w = z⁻¹, one period of delay:
//   proxy   A(w) q = S(w) h     order 1: A = M(1−w)²/T² + B(1−w)/T + K_v,  S = 1
//                               order 2: A = M(1−w)²/T² + W(w)[B D + K_v],  S = 1 + (1−w)²/12,
//                                        D = (3 − 4w + w²)/(2T), W = (8 + 12w + 6w² + w³)/27 (force_weights.hpp)
//   drive   p = (1−β) q / (1−βw),  β = exp(−T/τ)              (τ = 0: p = q)
//   hand    h = −w^(1+L/T) [K_h + D_h(1−w)/T + m_h(1−w)²/T²] p
// So the eigenvalues z = 1/w are the roots of
//   C(w) = (1−βw) A(w) + (1−β) S(w) w^(1+L/T) [K_h + D_h(1−w)/T + m_h(1−w)²/T²].
// L is the loop's delay beyond the one period that any sampled loop has. A fraction of a period is interpolated
// linearly. m_h includes handle and hand, because the sensor measures the force that moves both.
//
// With lookahead (rendering/lookahead.hpp), the drives are sent to where a coasting proxy will be after s = H/T steps:
//   q + s(q − q₁) = P q,   P(w) = 1 + s(1−w)
// In C, P multiplies the term with (1−β). The effect of B and K_v within H is neglected.
//
// With `arms`, the arm is elastic and is judged in several poses. The eigenvalues are then those of elastic_loop.hpp,
// and the largest |z| over all poses decides. The rest of this comment applies to C, the rigid arm.
//
// With `layers`, a mass counts as stable only if it is stable in free motion and while the proxy presses on each entry
// of `layers` (models/surfaces/layer.hpp). A layer is a spring along its normal n: K_v becomes K_v + k n nᵀ. In C,
// which has one dimension, K_v becomes K_v plus the entry's largest stiffness.
//
// The smallest stable mass is found by D-decomposition (Neimark):
// 1. C is linear in M: C = M X + Y.
// 2. A root lies on the unit circle, at w = exp(−jθ), for the mass M(θ) = −Y/X, if M(θ) is real and positive. A sweep
//    over θ finds all such masses.
// 3. Stability doesn't change between two neighbouring masses of this kind.
//
// So the smallest mass above which all masses are stable is exact, even if the stable masses form several intervals.
//
// For set-up, not for the cycle: takes some hundred microseconds per mass, with `arms` some milliseconds; allocates.
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "controller/setpoints/gear_damping.hpp"
#include "controller/stability/elastic_loop.hpp"

namespace proxarm::controller {

// How the person holds the tool. The defaults are the default cell's values.
struct HandModel {
  double stiffness_N_per_m = 500.0;  // K_h ≥ 0
  double damping_Ns_per_m = 20.0;    // D_h ≥ 0
  double mass_kg = 1.0;              // m_h ≥ 0, without the handle
};

// One elastic layer that the proxy presses on, or several layers where they meet.
struct LayerTouch {
  std::string what;                              // for messages: "layer 'foam' of 2 kN/m"
  models::Mat3 spring_W = models::Mat3::Zero();  // Σ k n nᵀ of the layers, N/m
  // The normal along which the proxy can still move while friction stops all other motion. Absent: no friction.
  std::optional<models::Vec3> sticks_along_W{};
};

struct LoopModel {
  double period_s = 1e-3;              // T > 0
  double delay_s = 0.0;                // L ≥ 0
  double drive_time_constant_s = 0.0;  // τ ≥ 0 of the drives' position loop
  // With `arms`: the drives follow by feed-forward instead of a lag (elastic_loop.hpp).
  bool feed_forward = false;
  // With `arms`: a mass must be stable with drives that lag and with drives that feed forward.
  bool either_drive = true;
  double handle_mass_kg = 0.0;    // mass of handle and tool behind the sensor
  double damping_Ns_per_m = 0.0;  // B ≥ 0 of the proxy
  double spring_N_per_m = 0.0;    // K_v ≥ 0 of the proxy
  // Order 1, for comparison: the damping is −B(q₁ − q₂)/T instead of the implicit one.
  bool explicit_damping = false;
  int order = 1;
  // Order 2 computes a step with order 1 where contacts change; at a wall, these are most steps. So a mass must be
  // stable with both orders. False: only order 2 is judged, in free motion.
  bool with_events = true;
  double horizon_s = 0.0;  // H ≥ 0 of the lookahead
  // True gear stiffness of `arms`, divided by the controller's value; > 0.
  double gear_stiffness_ratio = 1.0;
  // With `arms`: the gears that are damped by their measured torque, and κ (gear_damping.hpp).
  GearDampingChoice gear_damping{};
  // Measured torque divided by the true torque; how much later than declared the torque is read.
  double gear_torque_ratio = 1.0, gear_torque_late_s = 0.0;
  // 1/ω ≥ 0 of the setpoint filter, whose delay 2/ω is included in delay_s. A filter_s above 0 models the filter as two
  // first-order lags instead of a pure delay. This matters when a horizon is chosen: lookahead compensates the phase of
  // lags better than the phase of a delay.
  double filter_s = 0.0;
  std::shared_ptr<const std::vector<ElasticArm>> arms{};  // elastic arm in each pose that is judged; null: a rigid arm
  std::shared_ptr<const std::vector<LayerTouch>> layers{};  // judged in addition to free motion; null: none
};

// The mass that an elastic loop requires is multiplied by this. The computed smallest stable masses differ from those
// of the simulated arm by −8 to 15 %.
inline constexpr double elastic_margin = 1.05;

// Returns a mass or inertia rounded up to two significant digits, for messages.
double round_up(double mass);

// Returns the largest |z| of all eigenvalues; the loop is stable below 1. proxy_mass_kg > 0 is the felt mass without
// the handle's mass.
double spectral_radius(const HandModel& hand, const LoopModel& loop, double proxy_mass_kg);

// Returns the proxy's mass, kg, above which every mass up to max_mass_kg is stable; at least 1e-6. Returns nullopt if
// max_mass_kg itself is unstable.
std::optional<double> smallest_stable_mass(const HandModel& hand, const LoopModel& loop, double max_mass_kg = 1000.0);

// Margins of an advised mass. The mass must be stable with every combination of three values: the hand's stiffness and
// mass, each as given or hand_margin times as large, and the delay, as given or delay_margin times as long.
inline constexpr double hand_margin = 1.5, delay_margin = 1.2;
// Returns whether `holds` is true for all these combinations.
bool with_margins(const HandModel& hand, const LoopModel& loop,
                  const std::function<bool(const HandModel&, const LoopModel&)>& holds);

// Ratios of the true gear stiffness to the controller's value that a loop must tolerate.
inline constexpr std::array<double, 3> gear_margins{0.7, 1.0, 1.4};
// Returns the horizon that `--lookahead auto` takes for this mass, s, in whole periods. It is the longest horizon, up
// to `auto_share` of the loop's delay, that makes no stable loop unstable, and makes no unstable loop worse than the
// worst loop without lookahead. The loops are all combinations of
// - each pose;
// - the hand's stiffness, as given or hand_margin times as large;
// - the hand's mass, as given or heavy_hand times as large;
// - the delay, as given or, without the filter's part, delay_margin times as long;
// - each ratio of gear_margins.
//
// A horizon beyond auto_share would make the felt mass worse again. heavy_hand and elastic_margin together make a
// factor of two. Precondition: loop.filter_s is set.
inline constexpr double auto_share = 0.85, heavy_hand = 1.9;
double stable_horizon_s(const HandModel& hand, const LoopModel& loop, double proxy_mass_kg);

// Errors that a loop with torque-damped gears must tolerate. First error: torques are measured a fifth too large and 2
// ms late. Second error: the gears have gear_margins.front() of their stiffness. (Torques measured a fifth too small
// are less critical.)
inline constexpr double torque_margin = 0.2, late_torque_s = 0.002;
// Returns the gear damping κ of a session, 1/s, for the joints in `loop.gear_damping`: the tried κ with the smallest
// stable mass. With this κ, gears of gear_margins.back() times their stiffness must also come to rest under proxies of
// 10 and 50 kg, in the given hand and in a hand heavy_hand times as heavy. Returns 0 if no κ does this, or if no κ
// makes a lighter mass stable.
inline constexpr std::array<double, 7> tried_gear_dampings_per_s{220.0, 180.0, 140.0, 100.0, 70.0, 40.0, 20.0};
double best_gear_damping_per_s(const HandModel& hand, const LoopModel& loop);

// A damping B, and the smallest mass that is stable with it.
struct DampedMass {
  double damping_Ns_per_m = 0.0, mass_kg = 0.0;
};
// Dampings that are tried, Ns/m. From about 5 on they feel like a heavier handle, from 50 on like honey.
inline constexpr std::array<double, 9> tried_dampings{1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0};
// Returns the smallest damping, and its mass, for which `smallest` returns at most `most_kg`; nullopt if there is none.
// Tries tried_dampings times `unit`, where they are above the loop's own damping.
std::optional<DampedMass> least_damping(const LoopModel& loop, double most_kg,
                                        const std::function<std::optional<double>(const LoopModel&)>& smallest,
                                        double unit = 1.0);

// A layer that requires more mass than free motion does.
struct LayerLimit {
  std::string what;               // LayerTouch::what
  std::optional<double> mass_kg;  // smallest stable mass of the proxy on this layer; absent: no mass is stable
};
// Returns the layer that requires the largest mass; nullopt if free motion requires as much.
std::optional<LayerLimit> decisive_layer(const HandModel& hand, const LoopModel& loop);

// Returns the loop with only the two entries of `layers` on which this mass is least stable. Saves time where many
// loops are judged.
LoopModel with_worst_layers(const HandModel& hand, const LoopModel& loop, double proxy_mass_kg);

// Checks --mass. Throws description::SetupError if the felt mass (proxy and handle) is unstable, or not above the
// handle's mass; with `force_unstable` only in the second case. The error names the smallest stable felt mass, rounded
// up to two digits, a damping with which the wanted mass is stable, and the layer that requires more mass than free
// motion does. If no mass is stable, the error names the smallest damping with which some mass is stable.
void require_stable_mass(double felt_mass_kg, const HandModel& hand, const LoopModel& loop, bool force_unstable);

// Checks --inertia as require_stable_mass() checks --mass, for the tool's rotation. The fields of `hand` and `loop` are
// then rotational, in Nm/rad, Nms/rad and kg m²; `loop.arms` come from elastic_turning_arm().
void require_stable_inertia(double felt_inertia_kg_m2, const HandModel& hand, const LoopModel& loop,
                            bool force_unstable);

}  // namespace proxarm::controller
