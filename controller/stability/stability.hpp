// Is (26) stable while a hand holds the tool? Closed-loop eigenvalues in free motion, and the smallest mass that is
// stable.
//
// In free motion the loop is linear, with w = z⁻¹ one period of delay:
//   proxy   A(w) q = h          order 1: A = M(1−w)²/T² + B(1−w)/T + K_v
//                               order 2: A = M D² + B D + K_v, D = (3 − 4w + w²)/(2T); matched labels: h → (2−w) h
//   drive   p = (1−β) q / (1−βw),  β = exp(−T/τ)              (τ = 0: p = q)
//   hand    h = −w^(1+L/T) [K_h + D_h(1−w)/T + m_h(1−w)²/T²] p
// so the eigenvalues z = 1/w are the roots of
//   C(w) = (1−βw) A(w) + (1−β) w^(1+L/T) [K_h + D_h(1−w)/T + m_h(1−w)²/T²].
// L is the loop's delay beyond the one period that any sampled loop has. An L between two periods is taken as the
// weighted mean of both. What moves after the force sensor (the handle, the hand) belongs to m_h: the sensor doesn't
// see it push.
//
// With lookahead (rendering/lookahead.hpp) the drives are sent to where the proxy will be s = H/T steps on, if it
// coasts: q + s(q − q₁), which is P q with P(w) = 1 + s(1−w). P multiplies the term with (1−β). B and K_v change that
// point by their share of the acceleration within H alone, and are left out there.
//
// With the cell's arm in it (`arms`), whose gears give, eigenvalues are those of elastic_loop.hpp instead, the largest
// of all its poses. What follows is of C.
//
// C is linear in M (D-decomposition): C = M X + Y. The masses at which a root lies on the unit circle follow from a
// sweep over θ, w = exp(−jθ): those where M(θ) = −Y/X is real and positive. Between two neighbours of them stability
// doesn't change, which makes "the smallest mass above which all are stable" exact, also where the stable masses are
// several intervals.
//
// For set-up: takes some hundred microseconds, with an arm some milliseconds a mass; allocates, never runs in the
// cycle.
#pragma once

#include <functional>
#include <memory>
#include <optional>

#include "controller/stability/elastic_loop.hpp"

namespace proxarm::controller {

// How the person holds the tool. The default is the default cell's.
struct HandModel {
  double stiffness_N_per_m = 500.0;  // K_h ≥ 0
  double damping_Ns_per_m = 20.0;    // D_h ≥ 0
  double mass_kg = 1.0;              // m_h ≥ 0, without the handle
};

struct LoopModel {
  double period_s = 1e-3;              // T > 0
  double delay_s = 0.0;                // L ≥ 0
  double drive_time_constant_s = 0.0;  // τ ≥ 0 of the drives' position loop
  double handle_mass_kg = 0.0;         // after the sensor
  double damping_Ns_per_m = 0.0;       // B ≥ 0 of the proxy
  double spring_N_per_m = 0.0;         // K_v ≥ 0 of the proxy
  bool explicit_damping = false;       // −B(q₁ − q₂)/T instead of the implicit damping; order 1, for comparison
  int order = 1;
  bool matched_labels = false;
  double horizon_s = 0.0;  // H ≥ 0 of the lookahead
  // 1/ω ≥ 0 of the setpoints' filter, whose 2/ω are part of delay_s: for the choice of a horizon, where the filter
  // counts as the two lags that it is. What looks ahead makes up for their phase; as a pure delay they would seem
  // worse.
  double filter_s = 0.0;
  std::shared_ptr<const std::vector<ElasticArm>> arms{};  // in the poses that count; none: rigid
};

// The largest |z|; the loop is stable below 1. M is the proxy's (felt mass less the handle's), > 0.
double spectral_radius(const HandModel& hand, const LoopModel& loop, double proxy_mass_kg);

// The proxy's mass above which every mass up to max_mass_kg is stable (itself the boundary); nothing when max_mass_kg
// isn't stable. At least 1e-6 kg.
std::optional<double> smallest_stable_mass(const HandModel& hand, const LoopModel& loop, double max_mass_kg = 1000.0);

// The loops and hands that an advice holds for: the hand as described and one that is 1.5 times as stiff, and as heavy,
// and the delay as it is and 1.2 times as long.
inline constexpr double hand_margin = 1.5, delay_margin = 1.2;
// Whether `holds`, of a hand and a loop, is true of all of these.
bool with_margins(const HandModel& hand, const LoopModel& loop,
                  const std::function<bool(const HandModel&, const LoopModel&)>& holds);

// The horizon that `--lookahead auto` takes for this mass, in whole periods: the longest at which, and at all shorter
// ones, the loop is stable with the margins above; at most `auto_share` of the loop's delay, since beyond the felt mass
// gets worse again. The model has no elastic gears, which a long horizon sets ringing where the hand is heavy: below
// `auto_mass_ratio` times the hand's mass (1 kg at least) the horizon shrinks with the mass, as found by simulation
// with hands of 0.3 and 2 kg, 100 to 3000 N/m, and gears of 0.7 to 1.4 times the stiffness that is believed. 0 where
// the loop without lookahead has no such margins: what is left of them then isn't spent.
inline constexpr double auto_share = 0.85, auto_mass_ratio = 10.0;
double stable_horizon_s(const HandModel& hand, const LoopModel& loop, double proxy_mass_kg);

// What --mass must pass: throws description::SetupError that names the smallest felt mass (proxy and handle) that is
// stable, rounded up to two digits, or what else would help where no mass does; also for a mass at or below the
// handle's. With `force_unstable` only the latter.
void require_stable_mass(double felt_mass_kg, const HandModel& hand, const LoopModel& loop, bool force_unstable);

}  // namespace proxarm::controller
