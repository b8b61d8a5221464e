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
// C is linear in M (D-decomposition): C = M X + Y. The masses at which a root lies on the unit circle follow from a
// sweep over θ, w = exp(−jθ): those where M(θ) = −Y/X is real and positive. Between two neighbours of them stability
// doesn't change, which makes "the smallest mass above which all are stable" exact, also where the stable masses are
// several intervals.
//
// For set-up: takes some hundred microseconds, allocates, never runs in the cycle.
#pragma once

#include <optional>

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
};

// The largest |z|; the loop is stable below 1. M is the proxy's (felt mass less the handle's), > 0.
double spectral_radius(const HandModel& hand, const LoopModel& loop, double proxy_mass_kg);

// The proxy's mass above which every mass up to max_mass_kg is stable (itself the boundary); nothing when max_mass_kg
// isn't stable. At least 1e-6 kg.
std::optional<double> smallest_stable_mass(const HandModel& hand, const LoopModel& loop, double max_mass_kg = 1000.0);

// What --mass must pass: throws description::SetupError that names the smallest felt mass (proxy and handle) that is
// stable, rounded up to two digits, or what else would help where no mass does; also for a mass at or below the
// handle's. With `force_unstable` only the latter.
void require_stable_mass(double felt_mass_kg, const HandModel& hand, const LoopModel& loop, bool force_unstable);

}  // namespace proxarm::controller
