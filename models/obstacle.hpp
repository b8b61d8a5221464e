// One thing to touch, as a world of many sees it.
//
// A World asks each obstacle near the step what it would do alone, and combines those that matter by their tangent
// planes. To add a kind of object, implement this; a mesh and a moving object are obstacles too.
#pragma once

#include <array>
#include <cstdint>
#include <limits>

#include "models/flat_surface.hpp"
#include "models/geometric_algorithm.hpp"
#include "models/layer.hpp"

namespace proxarm::models {

// Axis-aligned, in W, metres; infinite where an object is (a plane, a cavity's outside).
struct Bounds {
  Vec3 low = Vec3::Constant(-std::numeric_limits<double>::infinity());
  Vec3 high = Vec3::Constant(std::numeric_limits<double>::infinity());

  [[nodiscard]] bool finite() const noexcept { return low.allFinite() && high.allFinite(); }
};

class Obstacle {
 public:
  // What the proxy does if nothing else is there: r = p and touches = false if p is reached without contact.
  struct Step {
    Vec3 r = Vec3::Zero();
    Vec3 normal = Vec3::Zero();  // unit, out of the object
    std::int32_t feature = 0;    // face, edge or region; an argument of tangent()
    bool touches = false;
    bool slips = false;
    bool resolved = true;  // false: no set of the object's own contacts was complete
  };

  // The object's surface as the proxy at r sees it.
  struct Tangent {
    FlatSurface<3> surface;
    double mu = 0.0;
  };

  Obstacle() = default;
  Obstacle(const Obstacle&) = default;
  Obstacle& operator=(const Obstacle&) = default;
  virtual ~Obstacle() = default;

  // 𝒢 of this object alone, for stiffness K; exact in the sense of (17): the force is K (r − p), friction acts against
  // N Nᵀ (r − q) at the normal of r. All these calls are noexcept, allocate nothing and lock nothing.
  [[nodiscard]] virtual Step step(double K, const Vec3& p, const Vec3& q) const noexcept = 0;

  // The contacts of that step, `s` being what it has returned: one, but for objects of several surfaces. Returns how
  // many; their `object` is the caller's to fill in.
  [[nodiscard]] virtual std::size_t contacts(double /*K*/, const Vec3& /*p*/, const Vec3& /*q*/, const Step& s,
                                             std::array<Contact<3>, 3>& out) const noexcept {
    out[0] = {0, s.feature, s.slips, s.normal};
    return 1;
  }

  // Its elastic layer, if it has one, and whether that presses on a proxy at r.
  [[nodiscard]] virtual Layer layer() const noexcept { return {}; }
  [[nodiscard]] virtual bool presses_at(const Vec3& /*r*/) const noexcept { return false; }

  // True if r can't be where a proxy from q ends: inside by more than rounding, or on the far side of a thin object.
  [[nodiscard]] virtual bool excludes(const Vec3& q, const Vec3& r) const noexcept = 0;

  // Whether the straight way from x, which is allowed, to y leads inside or through, by more than rounding.
  [[nodiscard]] virtual bool bars(const Vec3& x, const Vec3& y) const noexcept = 0;

  // Where a proxy that gets around the object on its way from q to p (step() doesn't touch, though the straight way
  // passes the inside) leaves the surface it slid on; q itself if there is no such point.
  [[nodiscard]] virtual Vec3 detour(const Vec3& /*p*/, const Vec3& q) const noexcept { return q; }

  // The tangent plane at the point of the surface next to r; `feature` is the one that step() found.
  [[nodiscard]] virtual Tangent tangent(const Vec3& r, std::int32_t feature) const noexcept = 0;

  // Signed distance: exact outside up to its sign and rounding, negative inside.
  [[nodiscard]] virtual double distance(const Vec3& x) const noexcept = 0;

  [[nodiscard]] virtual Bounds bounds() const noexcept = 0;

  // Where the object's own motion takes the point q until now; q itself for what stands still.
  [[nodiscard]] virtual Vec3 carry(const Vec3& q) const noexcept { return q; }

  [[nodiscard]] virtual bool moves() const noexcept { return false; }

  // False only if nothing of it comes within `reach` (finite) of x.
  [[nodiscard]] virtual bool comes_within(const Vec3& x, double reach) const noexcept { return distance(x) <= reach; }

  // For an object without an inside, whose sides are all there is: whether it lies between two points, and then the
  // normal of what does so, towards x.
  virtual bool parts(const Vec3& /*x*/, const Vec3& /*y*/, Vec3& /*normal*/) const noexcept { return false; }

  // An object that is carried about is asked with coordinates that are rounded as those of this size are, metres.
  virtual void set_rounding_size(double /*size_m*/) noexcept {}

  // From the next step on; finite and not negative.
  virtual void set_friction(double friction) noexcept = 0;

  virtual void set_time(double /*time_s*/, double /*period_s*/) noexcept {}
};

}  // namespace proxarm::models
