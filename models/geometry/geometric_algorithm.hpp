// 𝒢: the geometric rule that describes a virtual world to a proxy.
//
// Kikuuwe and Fujimoto, "Incorporating Geometric Algorithms in Impedance- and Admittance-Type Haptic Rendering", Proc.
// World Haptics 2007. The whole project uses its equation numbers.
//
//   q(k) = 𝒢(K, p(k), q(k−1))                                    (1a)
//   f(k) = K (q(k) − p(k))                                        (1b)
//
// p is where the proxy would go without the world, q where the world lets it go, K > 0 the stiffness of the coupling
// between them (N/m), f the world's force on the proxy. All vectors are in one frame, lengths in metres.
//
// Assumption 1 (K-independence): if r = 𝒢(K, r − f/K, q) for one K > 0, then r = 𝒢(κ, r − f/κ, q) for every κ > 0. Each
// 𝒢 must satisfy it; the contract tests (tests/models/surfaces/contract.hpp) and `proxarm check` test it. With it, the
// same 𝒢 renders on impedance-type devices (1), (23) and on admittance-type ones (26).
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "models/geometry/geometry.hpp"

namespace proxarm::models {

// A surface that pressed on the proxy in the last step.
template <int N>
struct Contact {
  std::int32_t object = 0;  // index in the scene; 0 for a 𝒢 of a single object; negative: not an object of the world
  std::int32_t feature = 0;        // face, edge or region within the object
  bool slips = false;              // false: the proxy sticks there, or there is no friction
  Vec<N> normal = Vec<N>::Zero();  // unit, out of the object
  // Only for a sticking contact: within this step the proxy slid over other faces to this point. Then v in (17) is 0,
  // not N Nᵀ (r − q)/T, and the point may depend on K.
  bool reached = false;
};

// What a 𝒢 may use besides K, p and q. Only moving objects and laws that contain time need it.
struct StepTime {
  double time_s = 0.0;     // time of q(k), at the end of the step
  double period_s = 1e-3;  // T; 2T/3 at order 2
};

// A geometric algorithm in N dimensions. Calls neither allocate, lock nor throw. A call may remember where the proxy
// was (warm starts), so each proxy needs a separate instance; the returned point depends only on the arguments.
template <int N>
class GeometricAlgorithm {
 public:
  GeometricAlgorithm() = default;
  GeometricAlgorithm(const GeometricAlgorithm&) = default;
  GeometricAlgorithm& operator=(const GeometricAlgorithm&) = default;
  virtual ~GeometricAlgorithm() = default;

  // 𝒢(K, p, q). Precondition: K > 0 in N/m, p and q finite. The result is finite, and the way from q to it passes
  // through no object.
  virtual Vec<N> operator()(double K, const Vec<N>& p, const Vec<N>& q) noexcept = 0;

  // Call it before each step of a world that moves or whose laws contain time; most worlds ignore it.
  virtual void set_time(const StepTime& /*time*/) noexcept {}

  // False if set_time() does nothing; a proxy then skips the call.
  [[nodiscard]] virtual bool wants_time() const noexcept { return true; }

  // The contacts that press after the last step; empty in free motion. Valid until the next call.
  [[nodiscard]] virtual std::span<const Contact<N>> contacts() const noexcept { return {}; }

  // Steps so far in which no answer kept all of the world's laws and one law was given up: moving objects squeeze the
  // proxy, or two faces jam it. Deserves a warning, and a fault if it lasts.
  [[nodiscard]] virtual std::uint64_t unresolved_steps() const noexcept { return 0; }

  // Whether moving objects left the proxy inside an object in the last step, for lack of room. A fault.
  [[nodiscard]] virtual bool squeezed() const noexcept { return false; }

  // A number for the set of media at q (media act without a surface); 0: none. A proxy of order 2 cuts its step where
  // it changes.
  [[nodiscard]] virtual std::uint32_t media_at(const Vec<N>& /*q*/) const noexcept { return 0; }

  // False if media_at() is always 0; a proxy then skips the call.
  [[nodiscard]] virtual bool has_media() const noexcept { return false; }
};

}  // namespace proxarm::models
