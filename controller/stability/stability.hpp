// Judges whether (26) is stable while a hand holds the tool: closed-loop eigenvalues in free motion, and the smallest
// stable mass.
//
// In free motion the loop is linear, with w = z⁻¹ one period of delay:
//   proxy   A(w) q = S(w) h     order 1: A = M(1−w)²/T² + B(1−w)/T + K_v,  S = 1
//                               order 2: A = M(1−w)²/T² + W(w)[B D + K_v],  S = 1 + (1−w)²/12,
//                                        D = (3 − 4w + w²)/(2T), W = (8 + 12w + 6w² + w³)/27 (force_weights.hpp)
//   drive   p = (1−β) q / (1−βw),  β = exp(−T/τ)              (τ = 0: p = q)
//   hand    h = −w^(1+L/T) [K_h + D_h(1−w)/T + m_h(1−w)²/T²] p
// so the eigenvalues z = 1/w are the roots of
//   C(w) = (1−βw) A(w) + (1−β) S(w) w^(1+L/T) [K_h + D_h(1−w)/T + m_h(1−w)²/T²].
// L is the loop's delay beyond the one period that any sampled loop has; a fraction of a period is interpolated
// linearly. m_h includes all that moves behind the force sensor (handle and hand), because the sensor measures the
// force that moves it.
//
// With lookahead (rendering/lookahead.hpp) the drives are sent to where a coasting proxy will be after s = H/T steps: q
// + s(q − q₁) = P q, with P(w) = 1 + s(1−w). P multiplies the term with (1−β). The effect of B and K_v within H is
// neglected.
//
// With `arms`, an elastic model of the cell's arm in several poses, the eigenvalues are those of elastic_loop.hpp, the
// largest over all poses. The rest of this comment applies to C.
//
// With `layers`, a mass counts as stable only if it is stable in free motion and on each touch of elastic layers
// (models/surfaces/layer.hpp). A layer is a spring along its normal, K_v + k n nᵀ; in C the spring is then K_v plus the
// touch's largest stiffness.
//
// C is linear in M: C = M X + Y. D-decomposition (Neimark) finds the masses at which a root lies on the unit circle: a
// sweep over θ, w = exp(−jθ), for real positive M(θ) = −Y/X. Between two such masses stability doesn't change. So the
// smallest mass above which all are stable is exact, even if the stable masses form several intervals.
//
// For set-up: some hundred microseconds per mass, with an arm some milliseconds; allocates; not for the cycle.
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "controller/setpoints/gear_damping.hpp"
#include "controller/stability/elastic_loop.hpp"

namespace proxarm::controller {

// How the person holds the tool. The default is that of the default cell.
struct HandModel {
  double stiffness_N_per_m = 500.0;  // K_h ≥ 0
  double damping_Ns_per_m = 20.0;    // D_h ≥ 0
  double mass_kg = 1.0;              // m_h ≥ 0, without the handle
};

// Elastic layers that the proxy presses on at once: one, or several where they meet.
struct LayerTouch {
  std::string what;                              // for messages: "layer 'foam' of 2 kN/m"
  models::Mat3 spring_W = models::Mat3::Zero();  // Σ k n nᵀ of the layers, N/m
  std::optional<models::Vec3> sticks_along_W{};  // friction stops all motion except along this normal; absent: no
                                                 // friction
};

struct LoopModel {
  double period_s = 1e-3;              // T > 0
  double delay_s = 0.0;                // L ≥ 0
  double drive_time_constant_s = 0.0;  // τ ≥ 0 of the drives' position loop
  bool feed_forward = false;           // with arms: the drives follow by feed-forward instead of a lag
                                       // (elastic_loop.hpp)
  bool either_drive = true;            // with arms: a mass must be stable with both kinds of drive
  double handle_mass_kg = 0.0;         // mass behind the sensor
  double damping_Ns_per_m = 0.0;       // B ≥ 0 of the proxy
  double spring_N_per_m = 0.0;         // K_v ≥ 0 of the proxy
  bool explicit_damping = false;       // −B(q₁ − q₂)/T instead of the implicit damping; order 1, for comparison
  int order = 1;
  // Order 2 steps by (26) where contacts change; at a wall that is most steps. So a mass must be stable with both
  // methods. False: free motion alone.
  bool with_events = true;
  double horizon_s = 0.0;             // H ≥ 0 of the lookahead
  double gear_stiffness_ratio = 1.0;  // > 0: the arms' true gear stiffness over the controller's value
  // With arms: gears damped by their torque (gear_damping.hpp); the ratio of measured to true torque; how much later
  // than declared the torque is read.
  GearDampingChoice gear_damping{};
  double gear_torque_ratio = 1.0, gear_torque_late_s = 0.0;
  // 1/ω ≥ 0 of the setpoint filter; delay_s includes its 2/ω. When a horizon is chosen, the filter is modelled as two
  // first-order lags, because lookahead compensates their phase better than a pure delay's.
  double filter_s = 0.0;
  std::shared_ptr<const std::vector<ElasticArm>> arms{};    // one for each pose that is judged; null: rigid arm
  std::shared_ptr<const std::vector<LayerTouch>> layers{};  // judged in addition to free motion; null: none
};

// Against the simulated arm, the smallest stable masses of elastic loops are off by −8 to 15 %, so 5 % more is
// required.
inline constexpr double elastic_margin = 1.05;

// Rounds up to two significant digits, as smallest masses and inertias are reported.
double round_up(double mass);

// Returns the largest |z|; the loop is stable below 1. proxy_mass_kg: felt mass less the handle's, > 0.
double spectral_radius(const HandModel& hand, const LoopModel& loop, double proxy_mass_kg);

// Returns the proxy's mass, kg, above which every mass up to max_mass_kg is stable, at least 1e-6; nullopt if
// max_mass_kg itself is unstable.
std::optional<double> smallest_stable_mass(const HandModel& hand, const LoopModel& loop, double max_mass_kg = 1000.0);

// Margins of an advised mass: it is stable with the given hand and one 1.5 times as stiff and as heavy, and with the
// given delay and one 1.2 times as long.
inline constexpr double hand_margin = 1.5, delay_margin = 1.2;
// Returns whether `holds` is true for all combinations of these hands and delays.
bool with_margins(const HandModel& hand, const LoopModel& loop,
                  const std::function<bool(const HandModel&, const LoopModel&)>& holds);

// True gear stiffness over the controller's value: the range that a loop must tolerate.
inline constexpr std::array<double, 3> gear_margins{0.7, 1.0, 1.4};
// Returns the horizon that `--lookahead auto` takes for this mass, s, in whole periods. It is the longest, up to
// `auto_share` of the loop's delay, that makes no stable loop unstable and no unstable loop worse than the worst one
// without lookahead. This is checked for all combinations of: each pose; the given hand, hand_margin times as stiff,
// heavy_hand times as heavy; the given delay and, except for the filter's part, delay_margin times as long; each of
// gear_margins. Beyond auto_share the felt mass gets worse again. Together with elastic_margin, heavy_hand makes a
// factor of two. Precondition: loop.filter_s is set.
inline constexpr double auto_share = 0.85, heavy_hand = 1.9;
double stable_horizon_s(const HandModel& hand, const LoopModel& loop, double proxy_mass_kg);

// Errors that a loop with torque-damped gears must tolerate, one at a time: torques measured a fifth too large and 2 ms
// late; gears as soft as gear_margins.front(). (Torques a fifth too small are less critical.)
inline constexpr double torque_margin = 0.2, late_torque_s = 0.002;
// Returns the gear damping κ, 1/s, of a session for the joints in `loop.gear_damping`: the tried value with the
// smallest stable mass. The gears must also come to rest with it under proxies of 10 and 50 kg, in a hand heavy_hand
// times as heavy, and with gears as stiff as gear_margins.back(). 0: no κ does, or none makes a lighter mass stable.
inline constexpr std::array<double, 7> tried_gear_dampings_per_s{220.0, 180.0, 140.0, 100.0, 70.0, 40.0, 20.0};
double best_gear_damping_per_s(const HandModel& hand, const LoopModel& loop);

// A damping B, and the smallest mass that is stable with it.
struct DampedMass {
  double damping_Ns_per_m = 0.0, mass_kg = 0.0;
};
// Dampings that are tried, Ns/m. From about 5 on they feel like a heavier handle, from 50 on like honey.
inline constexpr std::array<double, 9> tried_dampings{1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0};
// Returns the smallest tried damping, times `unit` and above the loop's own, for which `smallest` returns at most
// `most_kg`.
std::optional<DampedMass> least_damping(const LoopModel& loop, double most_kg,
                                        const std::function<std::optional<double>(const LoopModel&)>& smallest,
                                        double unit = 1.0);

// A layer that requires more mass than free motion.
struct LayerLimit {
  std::string what;               // LayerTouch::what
  std::optional<double> mass_kg;  // smallest stable mass of the proxy there; absent: no mass is stable
};
// Returns the touch that requires the largest mass; absent: free motion requires as much.
std::optional<LayerLimit> decisive_layer(const HandModel& hand, const LoopModel& loop);

// Returns the loop with only the two layers on which this mass is least stable; saves time where many loops are judged.
LoopModel with_worst_layers(const HandModel& hand, const LoopModel& loop, double proxy_mass_kg);

// The check of --mass. Throws description::SetupError if the felt mass (proxy and handle) is unstable, or not above the
// handle's; with `force_unstable` only for the latter. The error names the smallest stable felt mass, rounded up to two
// digits, a damping with which the wanted mass is stable, and the layer that requires more than free motion. If no mass
// is stable, it names the smallest damping with which some mass is.
void require_stable_mass(double felt_mass_kg, const HandModel& hand, const LoopModel& loop, bool force_unstable);

// The check of --inertia: the same for the tool's rotation. The fields of `hand` and `loop` are then rotational, in
// Nm/rad, Nms/rad and kg m²; `loop.arms` come from elastic_turning_arm().
void require_stable_inertia(double felt_inertia_kg_m2, const HandModel& hand, const LoopModel& loop,
                            bool force_unstable);

}  // namespace proxarm::controller
