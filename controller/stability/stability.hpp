// Whether (26) is stable while a hand holds the tool: closed-loop eigenvalues in free motion, and the smallest mass
// that is stable.
//
// In free motion the loop is linear, with w = z⁻¹ one period of delay:
//   proxy   A(w) q = S(w) h     order 1: A = M(1−w)²/T² + B(1−w)/T + K_v,  S = 1
//                               order 2: A = M(1−w)²/T² + W(w)[B D + K_v],  S = 1 + (1−w)²/12,
//                                        D = (3 − 4w + w²)/(2T), W = (8 + 12w + 6w² + w³)/27 (force_weights.hpp)
//   drive   p = (1−β) q / (1−βw),  β = exp(−T/τ)              (τ = 0: p = q)
//   hand    h = −w^(1+L/T) [K_h + D_h(1−w)/T + m_h(1−w)²/T²] p
// so the eigenvalues z = 1/w are the roots of
//   C(w) = (1−βw) A(w) + (1−β) S(w) w^(1+L/T) [K_h + D_h(1−w)/T + m_h(1−w)²/T²].
// L is the loop's delay beyond the one period that any sampled loop has. An L between two periods is interpolated
// linearly. What moves after the force sensor (the handle, the hand) belongs to m_h, because the sensor measures the
// force that moves it.
//
// With lookahead (rendering/lookahead.hpp) the drives are sent to where the proxy will be after s = H/T steps if it
// coasts: q + s(q − q₁) = P q, with P(w) = 1 + s(1−w). P multiplies the term with (1−β). B and K_v change that point
// only through the acceleration within H; this is neglected.
//
// With an elastic model of the cell's arm (`arms`), the eigenvalues are those of elastic_loop.hpp instead, the largest
// of all its poses. What follows applies to C.
//
// An elastic layer (models/surfaces/layer.hpp) that the proxy presses on is a spring along its normal, K_v + k n nᵀ,
// and what is stable in free motion needn't be stable there. So with `layers` a mass counts as stable only if it is in
// free motion and in each of these touches; of C the spring is K_v plus the touch's stiffest direction.
//
// C is linear in M: C = M X + Y. So the masses at which a root lies on the unit circle are found by D-decomposition
// (Neimark): a sweep over θ, w = exp(−jθ), finds where M(θ) = −Y/X is real and positive. Between two neighbouring
// masses stability doesn't change. This makes "the smallest mass above which all are stable" exact, even if the stable
// masses form several intervals.
//
// For set-up: takes some hundred microseconds, with an arm some milliseconds per mass; allocates, never runs in the
// cycle.
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
  std::optional<models::Vec3> sticks_along_W{};  // friction holds it but for this normal; none: it slides freely
};

struct LoopModel {
  double period_s = 1e-3;              // T > 0
  double delay_s = 0.0;                // L ≥ 0
  double drive_time_constant_s = 0.0;  // τ ≥ 0 of the drives' position loop
  bool feed_forward = false;           // with arms: the drives follow by feed-forward instead (elastic_loop.hpp)
  bool either_drive = true;            // with arms: a mass has to be stable with drives of both kinds
  double handle_mass_kg = 0.0;         // mass after the sensor
  double damping_Ns_per_m = 0.0;       // B ≥ 0 of the proxy
  double spring_N_per_m = 0.0;         // K_v ≥ 0 of the proxy
  bool explicit_damping = false;       // −B(q₁ − q₂)/T instead of the implicit damping; order 1, for comparison
  int order = 1;
  // Order 2 steps by (26) where contacts change, at a wall in most of its steps. So a mass counts as stable only if it
  // is with both. False: free motion alone.
  bool with_events = true;
  double horizon_s = 0.0;             // H ≥ 0 of the lookahead
  double gear_stiffness_ratio = 1.0;  // > 0, of the arms' true gears to those that the controller believes in
  // With arms: gears that are damped by their torque (gear_damping.hpp); what is measured of it to the true one, and
  // how much later it is read than is said.
  GearDampingChoice gear_damping{};
  double gear_torque_ratio = 1.0, gear_torque_late_s = 0.0;
  // 1/ω ≥ 0 of the setpoints' filter, whose 2/ω are part of delay_s. It is used when a horizon is chosen: the filter is
  // modelled there as the two first-order lags that it is. Lookahead compensates for their phase; a pure delay would
  // seem worse.
  double filter_s = 0.0;
  std::shared_ptr<const std::vector<ElasticArm>> arms{};    // in all poses that count; null: rigid
  std::shared_ptr<const std::vector<LayerTouch>> layers{};  // beside free motion; null: none
};

// Compared with the simulated arm, the smallest stable masses of elastic loops are off by −8 to 15 %, so a twentieth
// more is asked for.
inline constexpr double elastic_margin = 1.05;

// Up to two significant digits, as the smallest masses and inertias are told.
double round_up(double mass);

// The largest |z|; the loop is stable below 1. M is the proxy's (felt mass less the handle's), > 0.
double spectral_radius(const HandModel& hand, const LoopModel& loop, double proxy_mass_kg);

// The proxy's mass above which every mass up to max_mass_kg is stable; nullopt if max_mass_kg itself isn't. At least
// 1e-6 kg.
std::optional<double> smallest_stable_mass(const HandModel& hand, const LoopModel& loop, double max_mass_kg = 1000.0);

// The margins of an advice. It holds for the hand as described and for one 1.5 times as stiff and as heavy, and for the
// delay as it is and 1.2 times as long.
inline constexpr double hand_margin = 1.5, delay_margin = 1.2;
// Whether `holds` is true for all of these hands and loops.
bool with_margins(const HandModel& hand, const LoopModel& loop,
                  const std::function<bool(const HandModel&, const LoopModel&)>& holds);

// Gears from softer to stiffer than the controller believes.
inline constexpr std::array<double, 3> gear_margins{0.7, 1.0, 1.4};
// The horizon that `--lookahead auto` takes for this mass, in whole periods. It is the longest one, of at most
// `auto_share` of the loop's delay, with which no loop is unstable that is stable without, and none more than the worst
// of them is without: neither with the hand as described nor with one hand_margin times as stiff or heavy_hand times as
// heavy, with the delay as it is and, the filter's apart, delay_margin times as long, with each of gear_margins, in
// each pose. Beyond auto_share, the felt mass gets worse again. With the twentieth that elastic loops ask for beside,
// heavy_hand is twice. Precondition: loop.filter_s is the filter's.
inline constexpr double auto_share = 0.85, heavy_hand = 1.9;
double stable_horizon_s(const HandModel& hand, const LoopModel& loop, double proxy_mass_kg);

// What a loop that damps its gears by their torque has to hold with, each alone: torques that are measured a fifth too
// large and so much later than is said; gears as soft as gear_margins says. (Torques that are a fifth too small ask for
// less than those.)
inline constexpr double torque_margin = 0.2, late_torque_s = 0.002;
// The κ of gear damping that a session takes, of the joints that `loop` names: that of these with which the smallest
// mass is stable. The gears themselves have to come to rest with it, under a proxy so heavy that the hand doesn't
// matter, with these margins and as stiff as gear_margins says. 0: no κ holds, or none makes a lighter mass stable.
inline constexpr std::array<double, 7> tried_gear_dampings_per_s{220.0, 180.0, 140.0, 100.0, 70.0, 40.0, 20.0};
double best_gear_damping_per_s(const HandModel& hand, const LoopModel& loop);

// A damping B, and the smallest mass that is stable with it.
struct DampedMass {
  double damping_Ns_per_m = 0.0, mass_kg = 0.0;
};
// The dampings that are tried, Ns/m: by hand a heavier handle from about 5 on, honey from 50 on.
inline constexpr std::array<double, 9> tried_dampings{1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0};
// The least of them, times `unit` and above the loop's own, for which `smallest` finds a mass of at most `most_kg`.
std::optional<DampedMass> least_damping(const LoopModel& loop, double most_kg,
                                        const std::function<std::optional<double>(const LoopModel&)>& smallest,
                                        double unit = 1.0);

// What a layer asks for beyond free motion.
struct LayerLimit {
  std::string what;               // of the touch
  std::optional<double> mass_kg;  // the proxy's, the smallest that is stable there; absent: none is
};
// The touch that asks for most mass. Absent: free motion asks for as much.
std::optional<LayerLimit> decisive_layer(const HandModel& hand, const LoopModel& loop);

// The loop with the two layers on which this mass is the least stable: where it is asked dozens of times, for the sake
// of time.
LoopModel with_worst_layers(const HandModel& hand, const LoopModel& loop, double proxy_mass_kg);

// The check of --mass. Throws description::SetupError that names the smallest stable felt mass (proxy and handle),
// rounded up to two digits, and the damping with which the mass that is wanted is stable; if none is without damping,
// the least damping with which some is. It names the layer if one asks for more than free motion does. Also for a mass
// at or below the handle's. With `force_unstable` only the latter is checked.
void require_stable_mass(double felt_mass_kg, const HandModel& hand, const LoopModel& loop, bool force_unstable);

// The check of --inertia, which is the same question about the tool's rotation: `hand` and `loop` hold the hand's
// turning stiffness, damping and inertia, the handle's inertia, and the proxy's rotational damping and spring, in
// Nm/rad, Nms/rad and kg m²; `loop.arms` are elastic_turning_arm()'s.
void require_stable_inertia(double felt_inertia_kg_m2, const HandModel& hand, const LoopModel& loop,
                            bool force_unstable);

}  // namespace proxarm::controller
