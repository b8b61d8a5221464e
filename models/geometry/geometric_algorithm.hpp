// 𝒢, the geometric algorithm: the rule that describes a virtual world to a proxy.
//
// Source: Kikuuwe and Fujimoto, "Incorporating Geometric Algorithms in Impedance- and Admittance-Type Haptic
// Rendering", Proc. World Haptics 2007. The whole project uses this paper's equation numbers.
//
//   q(k) = 𝒢(K, p(k), q(k−1))                                    (1a)
//   f(k) = K (q(k) − p(k))                                        (1b)
//
// p is where the proxy would go without the world, and q is where the world lets it go. K > 0 is the stiffness of the
// coupling between p and q (N/m). f is the world's force on the proxy. All vectors are in one frame, lengths in metres.
//
// Assumption 1 (K-independence): if r = 𝒢(K, r − f/K, q) for one K > 0, then r = 𝒢(κ, r − f/κ, q) for every κ > 0. Each
// 𝒢 must satisfy Assumption 1; the contract tests (tests/models/surfaces/contract.hpp) and `proxarm check` test it.
// With Assumption 1, the same 𝒢 renders on impedance-type devices, (1) and (23), and on admittance-type devices, (26).
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "models/geometry/geometry.hpp"

namespace proxarm::models {

// A surface that pressed on the proxy in the last step.
template <int N>
struct Contact {
  // The object's index in the scene; 0 for a 𝒢 of a single object; negative if no object of the world makes this
  // contact.
  std::int32_t object = 0;
  std::int32_t feature = 0;        // face, edge or region within the object
  bool slips = false;              // false: the proxy sticks at the contact, or the contact has no friction
  Vec<N> normal = Vec<N>::Zero();  // unit, out of the object
  // Only for a sticking contact: whether, within this step, the proxy slid over other faces before it reached this
  // point. If so, v in (17) is 0 instead of N Nᵀ (r − q)/T, and the point may depend on K.
  bool reached = false;
};

// The time of a step, which a 𝒢 may use besides K, p and q. Only moving objects and laws that contain time need it.
struct StepTime {
  double time_s = 0.0;     // the time of q(k), which is the end of the step
  double period_s = 1e-3;  // the period T of the step; at order 2 it is 2T/3
};

// A geometric algorithm in N dimensions. Calls don't allocate, lock or throw. An instance may remember where the proxy
// was (for warm starts), so each proxy needs a separate instance. The returned point depends only on the arguments and
// on set_time().
template <int N>
class GeometricAlgorithm {
 public:
  GeometricAlgorithm() = default;
  GeometricAlgorithm(const GeometricAlgorithm&) = default;
  GeometricAlgorithm& operator=(const GeometricAlgorithm&) = default;
  virtual ~GeometricAlgorithm() = default;

  // Returns 𝒢(K, p, q). Precondition: K > 0 in N/m; p and q are finite. The result is finite, and the path from q to
  // the result passes through no object.
  virtual Vec<N> operator()(double K, const Vec<N>& p, const Vec<N>& q) noexcept = 0;

  // Sets the time of the next step. Call it before each step of a world that moves or whose laws contain time; most
  // worlds ignore it.
  virtual void set_time(const StepTime& /*time*/) noexcept {}

  // False if set_time() does nothing; a proxy then skips the call.
  [[nodiscard]] virtual bool wants_time() const noexcept { return true; }

  // Returns the contacts that pressed in the last step; empty in free motion. Valid until the next call.
  [[nodiscard]] virtual std::span<const Contact<N>> contacts() const noexcept { return {}; }

  // Returns the number of steps so far in which no point satisfied all of the world's laws, so that one law was given
  // up: moving objects squeezed the proxy, or two faces jammed it. A rising number deserves a warning, and a fault if
  // it goes on rising.
  [[nodiscard]] virtual std::uint64_t unresolved_steps() const noexcept { return 0; }

  // Whether, in the last step, moving objects left the proxy inside an object, for lack of room. This is a fault.
  [[nodiscard]] virtual bool squeezed() const noexcept { return false; }

  // Returns a number that identifies the set of media that act at q, or 0 if no medium acts there. (A medium acts in a
  // region, without a surface.) A proxy of order 2 cuts its step where this number changes.
  [[nodiscard]] virtual std::uint32_t media_at(const Vec<N>& /*q*/) const noexcept { return 0; }

  // False if media_at() is always 0; a proxy then skips the call.
  [[nodiscard]] virtual bool has_media() const noexcept { return false; }
};

}  // namespace proxarm::models
