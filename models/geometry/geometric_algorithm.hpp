// 𝒢: the geometric rule that a virtual world is made of.
//
// Kikuuwe and Fujimoto, "Incorporating Geometric Algorithms in Impedance- and Admittance-Type Haptic Rendering",
// Proc. World Haptics 2007; its equation numbers are used all over this project.
//
//   q(k) = 𝒢(K, p(k), q(k−1))                                    (1a)
//   f(k) = K (q(k) − p(k))                                        (1b)
//
// p is where the proxy would go if nothing were in its way, q where the world lets it go, K > 0 the stiffness of the
// coupling between them (N/m); f is the force from the world on the proxy. All vectors in one frame, metres.
//
// Assumption 1 (K-independence): if r = 𝒢(K, r − f/K, q) for one K > 0, then r = 𝒢(κ, r − f/κ, q) for every κ > 0.
// Each 𝒢 must satisfy it; the contract tests (tests/models/surfaces/contract.hpp) and `proxarm check` test it.
// With it, the same 𝒢 renders on impedance-type devices (1), (23) and on admittance-type ones (26).
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "models/geometry/geometry.hpp"

namespace proxarm::models {

// A surface that pressed on the proxy in the last step.
template <int N>
struct Contact {
  std::int32_t object = 0;   // index in the scene; 0 for a 𝒢 that is a single object; below 0: no part of the world
  std::int32_t feature = 0;  // face, edge or region within the object
  bool slips = false;        // false: the proxy sticks there, or there is no friction
  Vec<N> normal = Vec<N>::Zero();  // unit, out of the object
  // Of one that sticks: within this step the proxy slid over other faces to where it is held. v in (17) is 0 there, not
  // N Nᵀ (r − q)/T; where it is held may depend on K.
  bool reached = false;
};

// What a step may know besides K, p and q. Only laws that contain time, and objects that move, need it.
struct StepTime {
  double time_s = 0.0;     // time label of the q to come
  double period_s = 1e-3;  // T; at order 2 the effective one, 2T/3
};

// A geometric algorithm in N dimensions. Calls neither allocate, lock nor throw. A call may remember where the proxy
// was (warm starts), so each proxy needs an instance of its own; the returned point depends on the arguments alone.
template <int N>
class GeometricAlgorithm {
 public:
  GeometricAlgorithm() = default;
  GeometricAlgorithm(const GeometricAlgorithm&) = default;
  GeometricAlgorithm& operator=(const GeometricAlgorithm&) = default;
  virtual ~GeometricAlgorithm() = default;

  // 𝒢(K, p, q). Precondition: K > 0 in N/m, p and q finite. The result is finite, and the way from q to it passes
  // through nothing.
  virtual Vec<N> operator()(double K, const Vec<N>& p, const Vec<N>& q) noexcept = 0;

  // To be called before each step of a world that moves or whose laws contain time; most worlds ignore it.
  virtual void set_time(const StepTime& /*time*/) noexcept {}

  // False if set_time() never does anything: a proxy then leaves the call out.
  [[nodiscard]] virtual bool wants_time() const noexcept { return true; }

  // The contacts of the last step that press (empty: free). Valid until the next call.
  [[nodiscard]] virtual std::span<const Contact<N>> contacts() const noexcept { return {}; }

  // Steps so far for which the world found no answer that keeps all its laws, and gave up one of them: a proxy is
  // squeezed between moving objects, or two faces jam it. Worth a warning, and a fault if it goes on.
  [[nodiscard]] virtual std::uint64_t unresolved_steps() const noexcept { return 0; }

  // Whether the last step left the proxy inside of an object, because objects that move leave it no room. A fault.
  [[nodiscard]] virtual bool squeezed() const noexcept { return false; }

  // Which media hold the point q (they act without a surface), as a number; 0: none. A proxy of order 2 cuts its step
  // where this changes.
  [[nodiscard]] virtual std::uint32_t media_at(const Vec<N>& /*q*/) const noexcept { return 0; }

  // False if media_at() is always 0: a proxy then leaves the call out.
  [[nodiscard]] virtual bool has_media() const noexcept { return false; }
};

}  // namespace proxarm::models
